# SPDX-License-Identifier: Apache-2.0
"""A stretch of a file as a stream of its own."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any


class FileBytes(io.RawIOBase):
    """Some of a file's bytes, [start, stop): a recording without its torn last line, or a part of one."""

    def __init__(self, path: Path, start: int, stop: int) -> None:
        self._stream = path.open("rb", buffering=0)
        self._stream.seek(start)
        self._start, self._stop = start, stop
        self.failure: OSError | None = None
        """Why reading failed: a parser that calls this from C tells only that it did"""

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def tell(self) -> int:
        return self._stream.tell() - self._start

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        if whence != io.SEEK_SET:
            raise io.UnsupportedOperation("only from the start")
        return self._stream.seek(self._start + offset) - self._start

    def readinto(self, buffer: Any) -> int:
        try:
            block = self._stream.read(min(len(buffer), max(self._stop - self._stream.tell(), 0)))
        except OSError as failure:
            self.failure = failure
            raise
        buffer[: len(block)] = block
        return len(block)

    def close(self) -> None:
        self._stream.close()
        super().close()
