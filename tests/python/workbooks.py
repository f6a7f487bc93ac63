# SPDX-License-Identifier: Apache-2.0
"""Writes small workbooks of each format, and text files, from the same cells."""

import datetime
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import openpyxl
import xlwt

SUFFIXES = (".xlsx", ".xls", ".ods")

Rows = Sequence[Sequence[Any]]
"""Cells of a sheet; None for an empty cell"""


def workbook(path: Path, sheets: dict[str, Rows], hidden: Sequence[str] = ()) -> Path:
    """Writes the sheets of a workbook in the format of its suffix."""
    {".xlsx": _write_xlsx, ".xls": _write_xls, ".ods": _write_ods}[path.suffix](path, sheets, hidden)
    return path


def text_file(path: Path, rows: Rows, separator: str = ",") -> Path:
    """Writes the rows of a sheet as text; an empty row is an empty line."""
    lines = [separator.join("" if cell is None else str(cell) for cell in row) for row in rows]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def any_file(path: Path, rows: Rows) -> Path:
    """Writes the rows as text, or as the only sheet of a workbook."""
    return text_file(path, rows) if path.suffix == ".csv" else workbook(path, {"Data": rows})


def _write_xlsx(path: Path, sheets: dict[str, Rows], hidden: Sequence[str]) -> None:
    book = openpyxl.Workbook()
    book.remove(book.active)  # type: ignore[arg-type]
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        sheet.sheet_state = "hidden" if name in hidden else "visible"
        for row in rows:
            sheet.append(row)
    book.active = [name in hidden for name in sheets].index(False)
    book.save(path)


def _write_xls(path: Path, sheets: dict[str, Rows], hidden: Sequence[str]) -> None:
    book = xlwt.Workbook()
    of_time = xlwt.easyxf(num_format_str="hh:mm:ss.000")
    for name, rows in sheets.items():
        sheet = book.add_sheet(name)
        sheet.visibility = int(name in hidden)
        for number, row in enumerate(rows):
            for column, cell in enumerate(row):
                if isinstance(cell, datetime.time):
                    seconds = 3600 * cell.hour + 60 * cell.minute + cell.second + 1e-6 * cell.microsecond
                    sheet.write(number, column, seconds / 86400, of_time)
                elif cell is not None:
                    sheet.write(number, column, cell)
    book.active_sheet = [name in hidden for name in sheets].index(False)
    book.save(str(path))


def _write_ods(path: Path, sheets: dict[str, Rows], hidden: Sequence[str]) -> None:
    tables = "".join(
        f"<table:table table:name={quoteattr(name)} "
        f"table:style-name='{'hidden' if name in hidden else 'shown'}'>"
        + "".join(f"<table:table-row>{''.join(map(_ods_cell, row))}</table:table-row>" for row in rows)
        + "</table:table>"
        for name, rows in sheets.items()
    )
    write_ods_content(path, tables)


def write_ods_content(path: Path, tables: str) -> None:
    """Writes a workbook of LibreOffice from the XML of its sheets."""
    names = ("office", "table", "text", "style")
    spaces = " ".join(f"xmlns:{each}='urn:oasis:names:tc:opendocument:xmlns:{each}:1.0'" for each in names)
    styles = "".join(
        f"<style:style style:name='{name}' style:family='table'>"
        f"<style:table-properties table:display='{shown}'/></style:style>"
        for name, shown in (("shown", "true"), ("hidden", "false"))
    )
    content = (
        f"<?xml version='1.0' encoding='UTF-8'?><office:document-content {spaces} office:version='1.2'>"
        f"<office:automatic-styles>{styles}</office:automatic-styles>"
        f"<office:body><office:spreadsheet>{tables}</office:spreadsheet></office:body></office:document-content>"
    )
    manifest = (
        "<?xml version='1.0' encoding='UTF-8'?><manifest:manifest "
        "xmlns:manifest='urn:oasis:names:tc:opendocument:xmlns:manifest:1.0'/>"
    )
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet")
        archive.writestr("content.xml", content, zipfile.ZIP_DEFLATED)
        archive.writestr("META-INF/manifest.xml", manifest)


def _ods_cell(cell: Any) -> str:
    if cell is None:
        return "<table:table-cell/>"
    if isinstance(cell, datetime.time):
        value = f"PT{cell.hour:02d}H{cell.minute:02d}M{cell.second + 1e-6 * cell.microsecond:09.6f}S"
        return f"<table:table-cell office:value-type='time' office:time-value='{value}'/>"
    if isinstance(cell, (int, float)):
        return f"<table:table-cell office:value-type='float' office:value='{cell!r}'/>"
    text = str(cell).replace("&", "&amp;").replace("<", "&lt;")
    return f"<table:table-cell office:value-type='string'><text:p>{text}</text:p></table:table-cell>"
