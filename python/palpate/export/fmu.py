# SPDX-License-Identifier: Apache-2.0
"""Writes a model as a co-simulation FMU (FMI 3.0), with the binary for this machine and its C sources.

The FMU is the force law: input position, output force, and their derivative. It contains no structure.
"""

from __future__ import annotations

import sys
import tempfile
import uuid
import zipfile
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from .. import _core
from .._core.model import fingerprint
from .._core.portable import ExportedModel
from .._core.rendering import Scheme, default_play_radius
from ..model import Model
from ..planning.plan import require_force
from ..recording.files import replacing
from ..verdict import Finding, Verdict
from .c_header import header_text
from .exported import RANDOM_COUNTS, Exported, require_carried, require_mechanical, units_of
from .fmu_binary import (
    ENERGY,
    FORCE,
    POSITION,
    SLOPE,
    TIME,
    compile_sources,
    errors_of_binary,
    platform_of_binary,
)
from .request import Request, Written

_PREFIX = "palpate_model"
"""Name of the exported model in fmu.c."""

_BASE_UNITS = {
    "m": {"m": 1},
    "rad": {"rad": 1},
    "N": {"kg": 1, "m": 1, "s": -2},
    "N.m": {"kg": 1, "m": 2, "s": -2},
    "N/m": {"kg": 1, "s": -2},
    "N.m/rad": {"kg": 1, "m": 2, "s": -2, "rad": -1},
    "J": {"kg": 1, "m": 2, "s": -2},
}
"""Units of the variables by the exponents of their SI base units."""

_MEANINGS = {
    "time": "Simulation time",
    "position": "Position of the tool in the object; it is held until the next step",
    "force": "Force of the object on the tool; positive values push towards lower positions",
    "slope": "Derivative of the force by the position",
    "energy": "Energy stored in the object, plus a constant",
}

_DATE = (1980, 1, 1, 0, 0, 0)
"""Date of all files in the FMU, so that equal models give equal files."""


def write(request: Request) -> Written:
    """Writes the FMU of a model, compares its binary with the model, and returns the differences.

    Raises
    ------
    InputError
        There is no C compiler, or the model is not a force of position in units of mechanics.
    """
    fmu = Fmu.of(request)
    with tempfile.TemporaryDirectory() as folder:
        for name, text in fmu.sources().items():
            (Path(folder) / name).write_text(text, encoding="utf-8")
        binary = Path(folder) / fmu.binary_name
        compile_sources(Path(folder) / "fmu.c", binary)
        errors = errors_of_binary(binary, fmu.token, fmu.model)
        verdict = Verdict((*fmu.findings(), *errors.findings()))
        if verdict.level != "no":
            with replacing(request.output) as temporary:
                fmu.write_archive(temporary, binary)
    position, force = fmu.units
    return Written(
        verdict,
        {
            "FMU": f"{request.output}: FMI 3.0, co-simulation, C sources, binary for {platform_of_binary()}",
            "variables": f"input position [{position}], output force [{force}], their derivative",
            "force error": f"{errors.force:.2g} of the largest force, of the compiled binary",
            "slope error": f"{errors.slope:.2g} of the largest slope, of the derivative of the binary",
        },
        {
            "name": fmu.name,
            "platform": platform_of_binary(),
            "token": fmu.token,
            "force_error_share": errors.force,
            "slope_error_share": errors.slope,
        },
    )


@dataclass(frozen=True)
class Fmu:
    """Parts of an FMU: the exported model, its sources and descriptions."""

    name: str
    model: Model
    """Exported model, with its play radius"""
    exported: Exported

    @classmethod
    def of(cls, request: Request) -> Fmu:
        """Makes the tables of the identified model. Its plan is left out, because it holds for a device."""
        model = request.model
        require_force(model)
        require_mechanical(model, "an FMU")
        require_carried(model, "an FMU does not")
        content = model.to_dict() | {"plan": None, "certificate": None}
        if model.hysteretic and model.play_radius is None:
            content["play_radius"] = default_play_radius(model, 0.0)
        model = Model.from_dict(content)
        tables = ExportedModel(
            model, Scheme(structure="direct"), encoder_step=_unused_step(model), precision="double"
        )
        exported = Exported(
            _PREFIX,
            "" if request.model_file is None else request.model_file.name,
            tables,
            tables.check(RANDOM_COUNTS),
            fingerprint(model),
            None,
            units_of(model),
        )
        return cls(request.identifier(), model, exported)

    @property
    def units(self) -> tuple[str, str]:
        """Units of position and force in the notation of FMI."""
        position, force = self.exported.units
        return position, force.replace("*", ".")

    @property
    def binary_name(self) -> str:
        """Name of the binary on this machine."""
        return self.name + {"darwin": ".dylib", "win32": ".dll"}.get(sys.platform, ".so")

    @property
    def start(self) -> str:
        """Position before the first input: 0, or the nearest position of the domain."""
        return repr(min(max(0.0, float(self.model.lower[0])), float(self.model.upper[0])))

    @property
    def token(self) -> str:
        """Text by which a tool recognises that binary and description belong together."""
        return "{" + str(uuid.uuid5(uuid.NAMESPACE_URL, header_text(self.exported))) + "}"

    def findings(self) -> tuple[Finding, ...]:
        """Returns a sentence if the tables differ from the core by more than their proved error."""
        return tuple(each for each in self.exported.verdict.findings if each.level == "no")

    def sources(self) -> dict[str, str]:
        """Returns the C sources by name."""
        definitions = f'#define PALPATE_FMU_TOKEN "{self.token}"\n#define PALPATE_FMU_START {self.start}\n'
        return {
            "fmu.c": (Path(__file__).parent / "fmu.c").read_text(encoding="utf-8"),
            f"{_PREFIX}.h": f"{header_text(self.exported)}\n{definitions}",
        }

    def write_archive(self, path: Path, binary: Path) -> None:
        """Writes the FMU, a ZIP archive."""
        texts = {
            "modelDescription.xml": self.model_description(),
            "sources/buildDescription.xml": self.build(),
        }
        files = {name: text.encode() for name, text in texts.items()}
        files |= {f"sources/{name}": text.encode() for name, text in self.sources().items()}
        files[f"binaries/{platform_of_binary()}/{self.binary_name}"] = binary.read_bytes()
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, content in files.items():
                entry = zipfile.ZipInfo(name, _DATE)
                entry.compress_type = zipfile.ZIP_DEFLATED
                entry.external_attr = 0o644 << 16
                archive.writestr(entry, content)

    def build(self) -> str:
        """Returns buildDescription.xml, from which tools compile the sources."""
        root = Element("fmiBuildDescription", fmiVersion="3.0")
        configuration = SubElement(root, "BuildConfiguration", modelIdentifier=self.name)
        files = SubElement(configuration, "SourceFileSet", language="C99")
        SubElement(files, "SourceFile", name="fmu.c")
        return _text(root)

    def model_description(self) -> str:
        """Returns modelDescription.xml."""
        # XML has no form for control characters
        shown = "".join(c if c.isprintable() else "?" for c in self.exported.source)
        root = Element(
            "fmiModelDescription",
            fmiVersion="3.0",
            modelName=self.name,
            instantiationToken=self.token,
            description=f"Force law of {shown}; the force pushes towards lower positions",
            generationTool=f"palpate {_core.__version__}",
        )
        SubElement(
            root,
            "CoSimulation",
            modelIdentifier=self.name,
            canHandleVariableCommunicationStepSize="true",
            canGetAndSetFMUState="true",
            canSerializeFMUState="true",
            providesDirectionalDerivatives="true",
            providesAdjointDerivatives="true",
        )
        position, force = self.units
        slope = f"{force}/{position}"
        definitions = SubElement(root, "UnitDefinitions")
        for name in (position, force, slope, "J"):
            unit = SubElement(definitions, "Unit", name=name)
            SubElement(unit, "BaseUnit", {base: str(power) for base, power in _BASE_UNITS[name].items()})
        SubElement(root, "DefaultExperiment", startTime="0", stopTime="1", stepSize="0.001")
        variables = SubElement(root, "ModelVariables")
        for reference, name, attributes in (
            (TIME, "time", {"causality": "independent"}),
            (POSITION, "position", {"causality": "input", "start": self.start, "unit": position}),
            (FORCE, "force", {"causality": "output", "initial": "calculated", "unit": force}),
            (SLOPE, "slope", {"causality": "local", "initial": "calculated", "unit": slope}),
            (ENERGY, "energy", {"causality": "local", "initial": "calculated", "unit": "J"}),
        ):
            given = {"name": name, "valueReference": str(reference), "variability": "continuous"}
            SubElement(variables, "Float64", given | attributes | {"description": _MEANINGS[name]})
        structure = SubElement(root, "ModelStructure")
        for kind in ("Output", "InitialUnknown"):
            SubElement(structure, kind, valueReference=str(FORCE), dependencies=str(POSITION))
        return _text(root)


def _unused_step(model: Model) -> float:
    """Returns an encoder step that suits every domain. The FMU contains positions, and no counts."""
    lower, upper = float(model.lower[0]), float(model.upper[0])
    return max(upper - lower, abs(lower), abs(upper)) / 2**20


def _text(root: Element) -> str:
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"
