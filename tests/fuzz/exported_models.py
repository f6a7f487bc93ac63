# SPDX-License-Identifier: Apache-2.0
"""Writes exported models of every kind in both precisions as headers of C, and all.h, which includes them."""

import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "python" / "export")]

from exports import KINDS, header_of, tables_of  # noqa: E402


def main(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    includes, models = [], []
    for kind in KINDS:
        for precision in ("single", "double"):
            model, tables = tables_of(kind, precision=precision)
            name = f"{kind}_{precision}"
            header_of(model, tables, folder, name)
            includes.append(f'#include "{name}.h"')
            models.append(f"{precision.upper()}({name})")
    text = "\n".join(includes) + "\n#define ALL_MODELS(SINGLE, DOUBLE) " + " ".join(models) + "\n"
    (folder / "all.h").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
