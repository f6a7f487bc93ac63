# SPDX-License-Identifier: Apache-2.0
"""Page in the browser: from a recording to a model, a plan and a C header, on this computer only.

`state` holds what the user chose, as options of the command line; `session` computes everything else from it
with undo; `view` makes the HTML of the page, `charts` its charts; `server` listens on 127.0.0.1.
"""

from .server import serve
from .session import Session, StoppedError
from .state import Option, OptionTable, words_of

__all__ = ["Option", "OptionTable", "Session", "StoppedError", "serve", "words_of"]
