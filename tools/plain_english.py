# SPDX-License-Identifier: Apache-2.0
"""Checks the language of everything that people read: plain_english.py [--count] [FILE ...].

Reads comments, docstrings, messages and names of Python and C++ sources, comments of scripts and settings,
and paragraphs of Markdown pages. Reports each word or opening that CONTRIBUTING.md ("Language") forbids, each
sentence of more than MOST_WORDS words, and a mean sentence length above MEAN_WORDS for each kind of text.
"""

import argparse
import ast
import io
import os
import re
import subprocess
import sys
import tokenize
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

MOST_WORDS = 40
"""Largest number of words in a sentence"""

MEAN_WORDS = 20.0
"""Largest mean number of words in the sentences of one kind of text"""

LEAST_MESSAGE_WORDS = 4
"""Least number of words in a string of a program that is taken for a message"""

INSTEAD = {
    # metaphors where a term exists
    r"stor(?:y|ies) (?:of|[0-9])": "record, example",
    r"the house|a new room|rooms? is|arrows": "architecture, module, dependency rule",
    r"rungs?|ladders?": "model class, model selection, candidate structure",
    r"buzz(?:es|ing)?": "limit cycle",
    r"wish(?:es)?": "request",
    r"outlets?": "record sink",
    r"simulated bench": "test rig",
    r"tells?|told|telling": "reports, states, distinguishes",
    r"ask(?:s|ed|ing)?": "calls, requests, requires",
    r"believ(?:e|es|ed)": "accepts, assumes",
    r"a hair": "a number with a unit",
    r"swallow(?:s|ed)?": "exceeds, hides",
    r"earn(?:s|ed)?": "is accepted",
    r"has a say|have a say|the last word": "limits",
    r"answers? for": "is responsible for, replaces",
    r"no news|luck|alive": "not independent, random error, active",
    r"let go|gives? way|turn(?:s|ed)? (?:round|out)": "closed, yields, reverses, is",
    r"stands?|stood|standing": "is, represents, is stored",
    r"learn(?:s|t)? of": "receives",
    # indirect subjects and negated nouns
    r"somebody(?: else)?|nobody|who(?:m)?ever|whatever|wherever": "the user, a hand, no, any",
    r"(?<!there )(?:is|are|was|were|be) no (?!longer)\w+": "is not a",
    r"(?:that|which) (?:is|are|was) none": "no X",
    r"but for|nothing but": "except, only",
    r"no (?:more|less|fewer|other) than": "at most, at least, only",
    r"as (?:\w+ ){1,3}as (?:it|they|if) \w+": "a number",
    # possession and places used for existence
    r"(?:of|with|in) (?:its|their|his|our) own": "its own X, separate",
    r"by (?:itself|themselves)": "automatically, alone",
    r"beside|anew|alike|at hand|amiss": "with, again, equal, available, wrong",
    r"hardly|barely|ever (?:better|larger|smaller|finer)": "a number, 'almost not'",
    r"lest|hence|thereof|therein|whereby|wherein|henceforth|upon|thus": "a plain conjunction",
    r"for the sake of|by virtue of|in turn": "for, one after the other",
    r"makes? (?:up|out)|brings? along": "is, needs",
    r"(?:is|are|was) to be": "must be, is",
}
"""Pattern of a word or phrase, and the plain one"""

OPENINGS = {
    r"(?:whether|where|who|whose|how (?:far|large|many|much|often|long))\b": "a verb or a noun first",
    r"(?:and|but|nor)\b": "a sentence of its own",
    r"to be\b": "a verb in the third person",
    r"as (?:\w+ ){1,3}as\b": "a number",
}
"""Pattern at the start of a text, and the beginning to write"""

NAMES = {
    "tell tells told telling say says said": "report, state, message, output",
    "ask asks asked asking": "request, call, require",
    "believe believed hope hoped wish wishes": "accept, assume, request",
    "story stories": "record, example",
    "room rooms": "module, free space",
    "rung rungs ladder ladders": "model class, candidate structure",
    "outlet outlets": "record sink",
    "buzz buzzing softened": "limit cycle, limit-cycle scaled",
    "drained": "energy-limited",
    "beside anew alike alive amiss": "other, again, equal, active, wrong",
    "somebody nobody whoever whatever wherever": "user, hand, any, none",
    "felt sinful luck lucky die": "rendered, wrong, random, exit",
}
"""Forbidden words of names, and the plain ones"""

_WORD = re.compile(r"[A-Za-z][A-Za-z'\u2019-]*")
_NAME_WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+")
_FORBIDDEN_NAMES = {word: instead for words, instead in NAMES.items() for word in words.split()}
_FORBIDDEN = [(re.compile(rf"\b(?:{pattern})\b", re.I), instead) for pattern, instead in INSTEAD.items()]
_OPENINGS = [(re.compile(pattern, re.I), instead) for pattern, instead in OPENINGS.items()]
_CPP_TOKEN = re.compile(
    r'//[^\n]*|/\*.*?\*/|#\s*include[^\n]*|(?P<string>R"(\w*)\(.*?\)\2"|"(?:\\.|[^"\\])*")'
    r"|'(?:\\.|[^'\\])*'|[^\W\d]\w*|\d[\w.']*|\S",
    re.S,
)
_SENTENCE_END = re.compile(r"(?<=[.!?;:])\s+(?=[\"'`(]?[A-Z0-9`])|\n\s*\n|\n\s*[-*|]\s|\n\s*\d+\.\s")
_LIST = re.compile(r"\w+(?: \([^()]*\))?(?:, (?:and )?\w+(?: \([^()]*\))?){4,}")
_SCRIPT = re.compile(r"\s*#!|^\s*(?:set -\w+|sleep [\d.]+|cd \S+)$", re.M)
_PARAMETER = re.compile(r"^\s*[\w*, .]+ : .*$", re.M)
_SECTION = re.compile(r"^ *(Parameters|Returns|Raises|Notes|Examples|Attributes|Yields)\s*\n\s*-{4,}", re.M)


class Text(NamedTuple):
    """A piece of prose: its file, line, kind and words."""

    file: Path
    line: int
    kind: str
    """comment, docstring, message, page, test name or name"""
    words: str


def python_texts(file: Path) -> Iterator[Text]:
    """Yields comments, docstrings, messages and names of a Python file."""
    source = file.read_text(encoding="utf-8")
    lines: list[tuple[int, str]] = []
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT and "SPDX" not in token.string:
            lines.append((token.start[0], token.string.lstrip("#: ")))
    yield from _joined(file, lines)
    nodes = list(ast.walk(ast.parse(source)))
    documentation: set[int] = set()
    names: dict[str, int] = {}
    for node in nodes:
        body = getattr(node, "body", None)
        for each in body if isinstance(body, list) else []:
            value = each.value if isinstance(each, ast.Expr) else None
            if isinstance(value, ast.Constant) and isinstance(value.value, str):
                documentation.add(id(value))
                yield Text(file, each.lineno, "docstring", _prose(_PARAMETER.sub("\n", value.value)))
        for name in _defined(node):
            names.setdefault(name, node.lineno)
    yield from _names(file, names)
    inside: set[int] = set()
    for node in nodes:
        if isinstance(node, ast.JoinedStr):
            inside.update(id(part) for part in ast.walk(node) if part is not node)
            words = "".join(
                str(part.value) if isinstance(part, ast.Constant) else "N" for part in node.values
            )
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            words = node.value
        else:
            continue
        if id(node) not in documentation | inside:
            yield from _message(file, node.lineno, words)


def _defined(node: ast.AST) -> list[str]:
    """Returns the names that a node of a Python program defines."""
    if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
        return [node.name]
    if isinstance(node, (ast.Name, ast.Attribute)) and isinstance(node.ctx, ast.Store):
        return [node.id if isinstance(node, ast.Name) else node.attr]
    return [node.arg] if isinstance(node, ast.arg) else []


def _names(file: Path, names: dict[str, int]) -> Iterator[Text]:
    """Yields each name once, a test name as a sentence."""
    for name, line in names.items():
        if name.startswith("test_"):
            yield Text(file, line, "test name", " ".join(_NAME_WORD.findall(name)[1:]).lower())
        else:
            yield Text(file, line, "name", name)


def _message(file: Path, line: int, words: str) -> Iterator[Text]:
    """Yields a string of a program if it has enough words and is not a shell script."""
    is_script = "\n" in words and _SCRIPT.search(words)
    if not is_script and len(_WORD.findall(words)) >= LEAST_MESSAGE_WORDS:
        yield Text(file, line, "message", _prose(words))


def cpp_texts(file: Path) -> Iterator[Text]:
    """Yields comments, messages and names of a C++ file."""
    source = file.read_text(encoding="utf-8")
    lines: list[tuple[int, str]] = []
    names: dict[str, int] = {}
    message, started, line, end = "", 0, 1, 0
    for token in _CPP_TOKEN.finditer(source):
        value, line, end = token[0], line + source.count("\n", end, token.start()), token.start()
        if token["string"]:
            started, message = started or line, message + value
            continue
        if message and "#include" not in message:
            yield from _message(file, started, message.replace('"', "").replace("\\n", "\n"))
        message, started = "", 0
        if value.startswith("//") and "SPDX" not in value:
            # A comment after a member of a C++ class is not joined with the comment in the next line.
            lines.append((-line if value.startswith("///<") else line, value.lstrip("/<! ").rstrip()))
        elif value.startswith("/*"):
            lines += [(line + at, each.strip("/* ")) for at, each in enumerate(value.splitlines())]
        elif value.isidentifier():
            names.setdefault(value, line)
    yield from _joined(file, lines)
    for found in re.finditer(r"^(?:TYPED_)?TEST(?:_[FP])?\(\s*\w+,\s*(\w+)\)", source, re.M):
        line = names.pop(found[1], source.count("\n", 0, found.start()) + 1)
        yield from _names(file, {f"test_{found[1]}": line})
    yield from _names(file, names)


def script_texts(file: Path) -> Iterator[Text]:
    """Yields the comments of a Makefile, a script or settings; an indented line is a new sentence."""
    lines = enumerate(file.read_text(encoding="utf-8").splitlines(), 1)
    comments = [(line, re.match(r"\s*#(?!!| SPDX)(.*)", text)) for line, text in lines]
    yield from _joined(file, [(line, re.sub("^  +", "\n\n", found[1])) for line, found in comments if found])


def page_texts(file: Path) -> Iterator[Text]:
    """Yields the paragraphs of a Markdown page, without code and tables."""
    source = re.sub(
        r"^(```|~~~).*?^\1|^\s*\|.*?$|^<!--.*?-->|^(?: {4}|\t)\S.*?$|^\s*!\[.*?$",
        lambda found: "\n" * found[0].count("\n"),
        file.read_text(encoding="utf-8"),
        flags=re.M | re.S,
    )
    line = 1
    for paragraph in re.split(r"(\n\s*\n)", source):
        if paragraph.strip():
            yield Text(file, line, "page", _prose(paragraph.lstrip("# \n")))
        line += paragraph.count("\n")


def _joined(file: Path, lines: list[tuple[int, str]]) -> Iterator[Text]:
    """Comments on lines that follow each other are one text."""
    block: list[tuple[int, str]] = []
    for line, words in lines:
        if block and line != abs(block[-1][0]) + 1:
            yield Text(file, abs(block[0][0]), "comment", _prose("\n".join(each for _, each in block)))
            block = []
        block.append((line, words))
    if block:
        yield Text(file, abs(block[0][0]), "comment", _prose("\n".join(each for _, each in block)))


def _prose(words: str) -> str:
    """The text without code, quoted words, options, addresses and lines of a file of accounts."""
    words = re.sub(r"(?:^|\n)\s*(?:>>>|\.\.\.) .*", "\n", words)
    words = re.sub(r"``.*?``|`[^`\n]*`|:\w+:`.*?`|(?<!\w)(['\"])[\w-]+\1", "N", words)
    words = re.sub(r"^[ \t]*(?=--[a-z])|^\w+:x:\d.*$", "\n\n", words, flags=re.M)
    return re.sub(r"https?://\S+|\]\([^)]*\)|--[a-z][\w-]*", "", words).strip()


def sentences(text: Text) -> list[str]:
    """The sentences of a text; a list item, an option and a paragraph end one, in a message also a semicolon.

    A list of five or more names counts as one word.
    """
    if text.kind == "name":
        return []
    words = _LIST.sub("N", _SECTION.sub("\n\n", text.words))
    if text.kind == "message":
        words = words.replace("; ", "\n\n")
    return [each for each in _SENTENCE_END.split(words) if len(_WORD.findall(each)) > 1]


def findings(text: Text) -> Iterator[tuple[str, str]]:
    """Yields the kind and the sentence of each finding: forbidden words and openings, and long sentences."""
    if text.kind == "name":
        for word in map(str.lower, _NAME_WORD.findall(text.words)):
            if word in _FORBIDDEN_NAMES:
                yield f'"{word}"', f'"{word}" in {text.words} is forbidden; write: {_FORBIDDEN_NAMES[word]}'
        return
    for pattern, instead in _FORBIDDEN:
        for found in pattern.finditer(text.words):
            word = " ".join(found[0].lower().split())
            yield f'"{word}"', f'"{word}" is forbidden; write: {instead}'
    if text.kind in ("comment", "docstring", "message"):
        for pattern, instead in _OPENINGS:
            if found := pattern.match(text.words):
                yield f'opening "{found[0]}"', f'opens with "{found[0]}"; begin with {instead}'
    for sentence in sentences(text):
        if (count := len(_WORD.findall(sentence))) > MOST_WORDS:
            start = " ".join(sentence.split()[:8])
            yield "long sentence", f'{count} words, at most {MOST_WORDS}: "{start} ..."'


READERS = {".py": python_texts, ".cpp": cpp_texts, ".hpp": cpp_texts, ".md": page_texts}
SCRIPTS = (".sh", ".cmake", ".toml", ".clang-tidy", ".clang-format", "Makefile", "CMakeLists.txt", "run")
READERS |= dict.fromkeys(SCRIPTS, script_texts)
"""Reader for each suffix or name of a file"""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="*", type=Path, help="files to check; all tracked files by default")
    parser.add_argument("--count", action="store_true", help="print the number of each kind of finding only")
    options = parser.parse_args()
    tracked = subprocess.run(["git", "ls-files"], capture_output=True, text=True, check=True).stdout
    files = options.files or [Path(name) for name in tracked.splitlines()]
    counts: Counter[str] = Counter()
    lengths: dict[str, list[int]] = defaultdict(list)
    for file in files:
        reader = READERS.get(file.suffix) or READERS.get(file.name)
        if reader is None or file.stem.removeprefix("test_") == Path(__file__).stem or not file.exists():
            continue
        for text in reader(file):
            lengths[text.kind] += [len(_WORD.findall(each)) for each in sentences(text)]
            for kind, finding in findings(text):
                counts[f"{text.kind}: {kind}"] += 1
                if not options.count:
                    print(f"{file}:{text.line}: {text.kind}: {finding}")
    if options.count:
        for name, number in counts.most_common():
            print(f"{number:6} {name}")
    too_long = False
    for kind, words in sorted((kind, words) for kind, words in lengths.items() if words):
        mean = sum(words) / len(words)
        too_long |= mean > MEAN_WORDS
        print(f"{kind}: {len(words)} sentences, {mean:.1f} words on average (at most {MEAN_WORDS:g})")
    print(f"{sum(counts.values())} findings")
    return 1 if counts or too_long else 0


if __name__ == "__main__":
    try:
        status = main()
        sys.stdout.flush()
    except BrokenPipeError:  # the reader of the output has ended
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    sys.exit(status)
