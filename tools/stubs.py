# SPDX-License-Identifier: Apache-2.0
"""Writes the type stubs of palpate._core and the structures in the schema of model files, or checks both.

python tools/stubs.py [--check]
"""

import argparse
import difflib
import json
import re
import subprocess
import sys
import tempfile
from importlib import import_module
from pathlib import Path

MODULE = "palpate._core"
PACKAGE = Path(__file__).parents[1] / "python" / "palpate"
ALLOW_LIST = Path(__file__).with_name("stubtest_allowlist.txt")
SCHEMA = "model/model.schema.json"
STUBS_ONLY = f"""[mypy]
follow_imports = skip
follow_imports_for_stubs = true
[mypy-{MODULE}.*]
follow_imports = normal
"""
"""Settings for reading the stubs of the module alone; `mypy` checks the types that they use from NumPy"""
STRUCTURES = re.compile(r'(?<="Structure": {"enum": )\[.*?\]')
LICENCE = "# SPDX-License-Identifier: Apache-2.0\n"


def generated_files() -> dict[str, str]:
    """Returns path in the package -> text, for the type stubs and the schema of the compiled module."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "pybind11_stubgen", MODULE, "--exit-code", "-o", folder]
        subprocess.run(command, check=True)
        root = Path(folder) / "palpate"
        stubs = {
            str(path.relative_to(root)): LICENCE + path.read_text(encoding="utf-8")
            for path in sorted(root.rglob("_core*.pyi")) + sorted(root.glob("_core/**/*.pyi"))
        }
    structures = json.dumps(import_module(f"{MODULE}.rendering").structure_names)
    schema = (PACKAGE / SCHEMA).read_text(encoding="utf-8")
    return stubs | {SCHEMA: STRUCTURES.sub(structures, schema)}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="change no file, fail if the tree differs")
    check = parser.parse_args().check

    files = generated_files()
    n_different = 0
    for name, text in files.items():
        path = PACKAGE / name
        present = path.read_text(encoding="utf-8") if path.exists() else ""
        if not check:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        elif present != text:
            n_different += 1
            lines = difflib.unified_diff(
                present.splitlines(),
                text.splitlines(),
                f"{name} (in the tree)",
                f"{name} (of the module)",
                lineterm="",
            )
            print("\n".join(lines))
    if n_different:
        print("Stubs or schema do not describe the compiled module: run `make stubs`.", file=sys.stderr)
        return 1
    # The generated stubs use the type stubs of NumPy, which are complete from Python 3.11 on.
    if check and sys.version_info >= (3, 11):
        command = [sys.executable, "-m", "mypy.stubtest", MODULE, "--allowlist", str(ALLOW_LIST)]
        command += ["--mypy-config-file", "mypy.ini"]
        # In another folder, because its options invalidate the cache of mypy.
        with tempfile.TemporaryDirectory() as folder:
            Path(folder, "mypy.ini").write_text(STUBS_ONLY, encoding="utf-8")
            return subprocess.run(command, cwd=folder, check=False).returncode
    return 0


if __name__ == "__main__":
    sys.exit(main())
