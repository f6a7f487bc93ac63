# SPDX-License-Identifier: Apache-2.0
"""Program that reads the cells of a workbook in a separate process and writes them to its output.

The library ends its process if a workbook needs more memory than there is. The arguments are the folder of
python_calamine, the workbook, and the largest memory for its cells [bytes].
"""

from __future__ import annotations

import datetime
import marshal
import sys
from pathlib import Path
from typing import Any

MEMORY_STATUS = 3
"""Exit status if the cells need more memory than the limit."""

_EPOCH = datetime.datetime(1970, 1, 1)


def main(library_folder: str, path: str, memory_bytes: str) -> int:
    """Writes name, visibility and filled rows of each sheet in the format of `marshal`. Returns the status.

    Rows are a dictionary by row number. Empty cells are None, and those at the end of a row are left out. A
    cell with a date or a time is a pair of its text and its value [s].
    """
    sys.path.append(library_folder)
    from python_calamine import CalamineWorkbook, SheetTypeEnum, SheetVisibleEnum

    if sys.platform == "linux":
        _limit_memory(int(memory_bytes))
    try:
        book = _opened(CalamineWorkbook, path)
        sheets = []
        for each in book.sheets_metadata:
            if each.typ == SheetTypeEnum.WorkSheet:
                rows = _filled_rows(book.get_sheet_by_name(each.name))
                sheets.append((each.name, each.visible == SheetVisibleEnum.Visible, rows))
        sys.stdout.buffer.write(marshal.dumps(sheets))
    except MemoryError:
        return MEMORY_STATUS
    except BaseException as error:  # a defect of the library raises a subclass of BaseException only
        sys.stderr.write(f"{error}" or type(error).__name__)
        return 1
    return 0


def _limit_memory(further_bytes: int) -> None:
    """Limits the address space of this process to its present size and `further_bytes`."""
    import resource

    own_pages = int(Path("/proc/self/statm").read_text().split()[0])
    limit = own_pages * resource.getpagesize() + further_bytes
    _, highest = resource.getrlimit(resource.RLIMIT_AS)
    limit = limit if highest == resource.RLIM_INFINITY else min(limit, highest)
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _opened(library: Any, path: str) -> Any:
    """Opens a workbook in the format of its suffix, else in that of its content."""
    try:
        return library.from_path(path)
    except Exception as error:
        try:
            with open(path, "rb") as stream:
                return library.from_filelike(stream)
        except Exception:
            raise error from None


def _filled_rows(sheet: Any) -> dict[int, list[Any]]:
    left = [None] * sheet.start[1] if sheet.start else []
    rows = {}
    for number, row in enumerate(sheet.iter_rows(), 1):
        cells = [each if type(each) is float else _cell(each) for each in row]
        while cells and cells[-1] is None:
            cells.pop()
        if cells:
            rows[number] = left + cells
    return rows


def _cell(value: Any) -> Any:
    if isinstance(value, (float, int)):
        return value
    if isinstance(value, str):
        return value if value.strip() else None
    return str(value), _seconds(value)


def _seconds(value: Any) -> float:
    """Returns a duration or a time of day, or a date since 1970 [s]."""
    if isinstance(value, datetime.time):
        value = datetime.datetime.combine(_EPOCH, value)
    elif isinstance(value, datetime.date) and not isinstance(value, datetime.datetime):
        value = datetime.datetime.combine(value, datetime.time())
    since = value - _EPOCH if isinstance(value, datetime.datetime) else value
    return float(since.total_seconds())


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
