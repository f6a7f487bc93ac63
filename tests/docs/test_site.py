# SPDX-License-Identifier: Apache-2.0
"""The built site documents every public name, its search finds the words of a user, and it loads nothing.

`make docs` builds the site and runs these tests. `make test` does not run them, because a site that was built
earlier lacks new names.
"""

import importlib
import json
import re
import sys
import zlib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SITE = ROOT / "build" / "docs" / "html"
HEADERS = ROOT / "cpp" / "include" / "palpate"
sys.path.insert(0, str(ROOT / "docs" / "builder"))

import python_pages  # noqa: E402

pytestmark = [
    pytest.mark.docs,
    pytest.mark.skipif(not (SITE / "searchindex.js").exists(), reason="needs the site, run make docs"),
]


def documented(domain: str) -> dict[str, str]:
    """Returns name -> address of each name of a domain, from the inventory of the site."""
    lines = (SITE / "objects.inv").read_bytes().split(b"\n", 4)[4]
    entries = (line.split(" ", 4) for line in zlib.decompress(lines).decode().splitlines())
    return {name: address for name, kind, _, address, _ in entries if kind.startswith(f"{domain}:")}


def test_every_public_python_name_has_a_page() -> None:
    names = documented("py")
    for package, public in python_pages.page_names().items():
        assert {f"{package}.{name}" for name in public} <= set(names)
        assert (SITE / "generated" / "python" / f"{package}.html").is_file()
        for name in public:
            assert (SITE / "generated" / "python" / "names" / f"{package}.{name}.html").is_file()


def test_every_name_that_a_package_exports_is_public() -> None:
    for package, names in python_pages.public_packages().items():
        module = importlib.import_module(package)
        assert all(hasattr(module, name) for name in names)
    assert {"palpate", "palpate.planning", "palpate.recording"} <= set(python_pages.public_packages())


def public_cpp_types() -> set[str]:
    """Returns the classes, structs, enums and concepts of the headers, without those in detail namespaces."""
    names = set()
    for header in HEADERS.rglob("*.hpp"):
        if "detail" not in header.relative_to(HEADERS).parts:
            text = header.read_text(encoding="utf-8")
            text = re.sub(
                r"^namespace (?:palpate::)?detail \{.*?^\}  // namespace (?:palpate::)?detail$",
                "",
                text,
                flags=re.S | re.M,
            )
            pattern = r"^(?:class|struct|enum class|concept) (?:\[\[\w+\]\] )?(\w+)(?=[^;<]*[{=])"
            names |= set(re.findall(pattern, text, re.MULTILINE))
    return names


def test_every_public_cpp_type_has_an_entry() -> None:
    spaces = r"palpate::((wire|mit|moteus|hid::pid|hid)::)?"
    names = {re.sub(spaces, "", name, count=1) for name in documented("cpp")}
    types = public_cpp_types()
    assert len(types) > 150
    assert types - names == set()


def test_the_notebook_is_in_the_navigation_with_its_outputs() -> None:
    page = "generated/notebook.html"
    assert f'href="{page}"' in (SITE / "index.html").read_text(encoding="utf-8")
    text = (SITE / page).read_text(encoding="utf-8")
    assert text.count("Output of the cell above") == 5
    captions = re.findall(r"<caption[^>]*>(\w+)</caption>", text)
    assert captions == ["Recording", "Model", "Verification", "Plan", "Recording"]
    (download,) = re.findall(r'href="(\.\./_downloads/[^"]+/notebook\.ipynb)"', text)
    assert (SITE / page).parent.joinpath(download).is_file()


@pytest.mark.parametrize("page", ["index.html", "generated/cpp/model.html"])
def test_the_navigation_has_the_titles_of_all_pages_and_no_names_within_them(page: str) -> None:
    text = (SITE / page).read_text(encoding="utf-8")
    (navigation,) = re.findall(r'<div class="sidebar-tree">.*?</div>', text, re.DOTALL)
    linked = re.findall(r'<a class="[^"]*reference internal" href="([^"]+)"', navigation)
    assert [address for address in linked if re.search("#.", address)] == []
    pages = {address.rsplit("/", 1)[-1] for address in linked}
    made = {file.name for file in (SITE / "generated").rglob("*.html")}
    assert len(made) > 100
    assert made - pages <= {Path(page).name}


def search_index() -> dict[str, object]:
    text = (SITE / "searchindex.js").read_text(encoding="utf-8")
    index: dict[str, object] = json.loads(text.removeprefix("Search.setIndex(").rstrip().rstrip(")"))
    return index


@pytest.mark.parametrize("word", ["resolvent", "certificate", "udev", "b_o"])
def test_the_search_finds_pages_with_a_word(word: str) -> None:
    terms = search_index()["terms"]
    assert isinstance(terms, dict)
    # The index contains the stem of a word.
    assert [term for term in terms if word.startswith(term) and len(term) >= min(len(word), 5)]


@pytest.mark.parametrize("page", ["index.html", "search.html", "tutorial.html", "gallery/index.html"])
def test_a_page_loads_nothing_from_the_network(page: str) -> None:
    text = (SITE / page).read_text(encoding="utf-8")
    loaded = re.findall(r"<(?:script|img|iframe)[^>]*src=\"([^\"]+)\"", text)
    loaded += re.findall(r"<link[^>]*rel=\"(?:stylesheet|preload)\"[^>]*href=\"([^\"]+)\"", text)
    assert loaded
    assert [address for address in loaded if re.match(r"(?:https?:)?//", address)] == []
