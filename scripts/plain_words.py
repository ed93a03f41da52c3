#!/usr/bin/env python3
"""Checker of how the sources are worded: docstrings, comments, names, messages, pages of the manual and commit subjects.

    scripts/plain_words.py                 # fails where a room breaks a rule more often than scripts/plain_words.json allows
    scripts/plain_words.py --list [RULE]   # prints every finding, or those of one rule
    scripts/plain_words.py --write         # lowers the allowed counts to those of today
    scripts/plain_words.py --commits 20    # checks the subjects of the last commits as well

A line that must break a rule has `plain-words: ok` in a comment on it or above it. Needs nothing but the standard library.
"""

from __future__ import annotations

import argparse
import ast
import io
import json
import re
import subprocess
import sys
import tokenize
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
ALLOWED = Path(__file__).with_suffix(".json")

RULES = {
    "opener": "a docstring or comment begins with a word that leaves its sentence without a subject",
    "no-verb": "the first line of a function's docstring does not begin with a verb",
    "too-short": "the first line of a docstring is a shape, or has fewer than three words",
    "coined-name": "a name contains a word of our own where the field has a term",
    "test-name": "a test's name lacks a subject, or has fewer than three words",
    "bare-number": "a solver contains a number that has no name",
    "unexplained-constant": "a constant of a solver has no comment, or none that names the test that fixes it",
    "inside-message": "the message of an error uses a word of the program's inside",
    "long-sentence": "a sentence of the manual has more than 40 words",
    "commit-subject": "a commit's subject is no imperative, or longer than 72 characters",
}

# A comment may begin with a preposition, as a clause may follow; a docstring may not, as it says what a thing is.
OPENER = re.compile(r"(Of|What|As|Which|That|Those|So many|So much)\b")
PREPOSITION = re.compile(
    r"(Likewise|By|On|Among|From|In|With|At|To|None|The same|Such|Beside|Without|Inside)\b"
)

# The words that docstrings begin with: imperatives; the third person of each is allowed too. A new verb may be added.
VERBS = set(
    """
    accept accumulate add adjust advance align allocate allow answer append apply approximate arrange ask
    assemble assert assign attach average avoid balance begin bind bound bracket break build calculate call
    cancel carry change check choose clamp classify clear clip close collect color combine come commit
    compare complete compute condense connect construct contain continue convert copy correct count create
    cut decide decode decompose define delete derive describe detach detect determine differ differentiate
    discard display distribute divide double draw drop dump eliminate embed empty encode end enforce ensure
    enter enumerate equal estimate evaluate exchange execute exist expand expect export extend extract
    extrapolate factorize fail feed fetch fill filter find finish fit fix flatten flip flush follow forget
    form format forward freeze gather generate get give go group grow guess halve handle hash have hide hold
    identify import improve include initialize insert integrate interpolate intersect invert is iterate join
    keep know label lead leave lengthen let lie limit linearize list load locate lock look lower make map
    mark match measure merge mesh minimize mirror mix move multiply name negate normalize notify number offer
    offset open order orient override pad paint parse partition pass pause perform perturb pick place plot pop
    predict prepare prescribe print process produce project propagate provide pull push put query raise read
    rebuild receive record recover reduce refactorize refer refine reflect refuse register reject release
    remove rename renumber reorder repeat replace report represent request require rescale reset resize
    resolve restart restore restrict return reuse reverse rotate round run sample satisfy save say scale
    scatter search see select send separate serve set settle shift shorten show shrink shuffle simulate skip
    solve sort specify split start state step stop store stretch submit subtract sum supply support switch
    take tell terminate test throw track transfer transform translate transpose traverse truncate try turn
    type unpack update use validate visit wait walk warn weld wrap write yield
    """.split()
)
NOUNS = set(
    "forces states faces loads rates shapes marks names limits steps lists measures cuts colors orders samples".split()
)

# A word in a name, and the field's term for it. Methods and parameters of the public interface were decided one by one:
# CHANGELOG.md lists what stays.
COINED = {
    "anchor": "proximal term",
    "beside": "adjacent",
    "bone": "link shape",
    "bones": "link shapes",
    "calmed": "numerically damped",
    "caps": "obtuse faces",
    "carried": "reduced coordinates",
    "carrier": "reduced coordinates",
    "carries": "has reduced coordinates",
    "cautious": "positive_definite",
    "couple": "moment",
    "course": "time series",
    "courses": "time series",
    "digest": "hash",
    "drift": "unconstrained",
    "drifts": "is unconstrained",
    "driven": "prescribed",
    "drives": "prescribes",
    "ever": "when",
    "feels": "depends on",
    "felt": "total applied field",
    "fold": "hinge",
    "folds": "hinges",
    "goes": "what it does",
    "gone": "what happened",
    "halved": "subdivided",
    "hold": "constraint",
    "hunt": "search",
    "insist": "retry",
    "keep": "storage",
    "kept": "stored",
    "knots": "time points",
    "landing": "contact predictor",
    "leap": "full step",
    "look": "assess",
    "mend": "repair",
    "mended": "repaired",
    "miss": "error",
    "neighboured": "adjacent",
    "offered": "mixin",
    "pack": "SIMD vector",
    "packs": "SIMD vectors",
    "place": "pose or position",
    "placed": "positioned",
    "places": "positions",
    "pushed": "contact force",
    "recount": "overcount correction",
    "remainder": "nonsymmetric part",
    "ride": "embedded",
    "rides": "embedded",
    "riding": "embedded",
    "rough": "inexact",
    "roughly": "inexact",
    "rub": "frictional pair",
    "settle": "initialize",
    "settled": "initialized",
    "share": "fraction",
    "shares": "fractions",
    "slide": "L-BFGS descent step",
    "slides": "L-BFGS descent steps",
    "spread": "what it varies",
    "standing": "static pose",
    "standstill": "stagnation",
    "steered": "parametrized",
    "stride": "implicit gradient-flow step",
    "strides": "implicit gradient-flow steps",
    "surrogate": "approximation",
    "surrogates": "approximations",
    "tell": "describe",
    "tells": "describes",
    "told": "describe",
    "touch": "contact point",
    "touches": "in contact",
    "touching": "in contact",
    "turn": "rotation",
    "turns": "winding numbers",
    "wants": "requires",
    "warily": "stop_on_instability",
    "wary": "stop_on_instability",
    "way": "path",
    "ways": "paths",
    "whole": "combined",
    "wing": "hinge side",
}
INSIDE = re.compile(
    r"\b(carrier|stencil|slot|clique|lane|the core|reduction|adjoint of|remembers|an unknown|unknowns|knots"
    r"|start\.turns|it is none)\b"
)
NO_SUBJECT = re.compile(
    r"(it|its|they|what|that|those|which|of|as|so|nothing|nobody|nowhere|others?|where|after|before|only|more|fewer|shorter"
    r"|longer|there|another|everything|everybody|whatever|whoever|two|one)_"
)
SOLVERS = (
    "cpp/magshell/solve/",
    "cpp/magshell/adjoint/",
    "cpp/magshell/contact/",
    "cpp/magshell/linalg/",
    "cpp/magshell/assembly/",
)
PLAIN_NUMBERS = {0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 24.0}  # coefficients of formulas


@dataclass(frozen=True)
class Finding:
    """A place in the sources that breaks a rule."""

    path: str
    line: int
    rule: str
    text: str

    @property
    def room(self) -> str:
        """The folder that its allowed counts are kept for."""
        parts = Path(self.path).parts
        depth = 3 if parts[:2] in (("cpp", "magshell"), ("python", "magshell")) else 2
        return "/".join(parts[: min(depth, len(parts) - 1)]) or "."


def main() -> int:
    """Run what the command line asks for; return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--list", nargs="?", const="", metavar="RULE", choices=["", *RULES])
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--commits", type=int, default=0, metavar="N")
    asked = parser.parse_args()
    found = list(findings(ROOT))
    if asked.list is not None:
        print(
            *(f"{f.path}:{f.line}: {f.rule}: {f.text}" for f in found if asked.list in ("", f.rule)), sep="\n"
        )
    today = counts(found)
    if asked.write:
        ALLOWED.write_text(json.dumps(today, indent=1, sort_keys=True) + "\n")
    wrong = excess(today, json.loads(ALLOWED.read_text()))
    wrong += [f"{f.text!r}: {RULES[f.rule]}" for f in commit_subjects(ROOT, asked.commits)]
    print(*wrong, sep="\n", end="\n" if wrong else "")
    return 1 if wrong else 0


def counts(found: list[Finding]) -> dict[str, dict[str, int]]:
    """Return how often each room breaks each rule."""
    rooms: dict[str, Counter] = {}
    for finding in found:
        rooms.setdefault(finding.room, Counter())[finding.rule] += 1
    return {room: dict(each) for room, each in rooms.items()}


def excess(today: dict[str, dict[str, int]], allowed: dict[str, dict[str, int]]) -> list[str]:
    """Return a line for each room and rule with more findings than allowed."""
    return [
        f"{room}: {n} times {rule}, {allowed.get(room, {}).get(rule, 0)} allowed ({RULES[rule]}; --list {rule} shows them)"
        for room, each in sorted(today.items())
        for rule, n in sorted(each.items())
        if n > allowed.get(room, {}).get(rule, 0)
    ]


def findings(root: Path) -> Iterator[Finding]:
    """Yield what breaks a rule in the files under version control."""
    listed = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard"], cwd=root, capture_output=True, text=True, check=True
    )
    checks = {".py": check_python, ".h": check_cpp, ".cpp": check_cpp, ".md": check_manual}
    for name in sorted(listed.stdout.splitlines()):
        check = checks.get(Path(name).suffix)
        if check is None or name == "CHANGELOG.md" or not (root / name).is_file():
            continue
        text = (root / name).read_text()
        lines = text.splitlines()
        for line, rule, said in check(name, text):
            if not any("plain-words: ok" in each for each in lines[max(0, line - 2) : line]):
                yield Finding(name, line, rule, " ".join(said.split())[:110])


Problem = tuple[int, str, str]  # line, rule, text


def check_python(name: str, text: str) -> Iterator[Problem]:
    """Yield the problems of a Python file."""
    yield from check_name(1, Path(name).stem)
    tree = ast.parse(text)
    yield from check_docstring(tree, "module")
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef):
            yield from check_docstring(node, "class")
            yield from check_name(node.lineno, node.name)
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            decorators = {getattr(each, "id", getattr(each, "attr", "")) for each in node.decorator_list}
            yield from check_docstring(
                node, "property" if decorators & {"property", "cached_property"} else "function"
            )
            if node.name.startswith("test_"):
                yield from check_test_name(node)
                continue
            yield from check_name(node.lineno, node.name)
            for argument in [*node.args.args, *node.args.kwonlyargs]:
                yield from check_name(argument.lineno, argument.arg)
        elif isinstance(node, ast.Raise) and node.exc is not None:
            parts = (each.value for each in ast.walk(node.exc) if isinstance(each, ast.Constant))
            message = " ".join(part for part in parts if isinstance(part, str))
            if INSIDE.search(message):
                yield node.lineno, "inside-message", message
    yield from check_comments((t.start[0], t.string) for t in comments(text))


def check_docstring(
    node: ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef, kind: str
) -> Iterator[Problem]:
    """Yield the problems of the first sentence of a docstring."""
    docstring = ast.get_docstring(node)
    if not docstring:
        return
    sentence = re.split(r"(?<=[a-z)\]])\.\s", docstring.split("\n\n")[0].replace("\n", " "))[0]
    words = re.findall(r"[A-Za-z]{2,}", re.sub(r"\([^()]*\)|\[[^\]]*\]", " ", sentence))
    first = re.match(r"[`'\"*(]*([A-Za-z]*)", sentence)
    at = node.body[0].lineno, f"{getattr(node, 'name', 'module')}: {sentence}"
    if OPENER.match(sentence) or PREPOSITION.match(sentence):
        yield at[0], "opener", at[1]
    elif len(words) < 3 or sentence.startswith(("(", "[")):
        yield at[0], "too-short", at[1]
    elif kind == "function" and not (first and begins_sentence(first[1].lower())):
        yield at[0], "no-verb", at[1]
    elif kind == "property" and not (
        first and (first[1].lower() in ("the", "a", "an") or begins_sentence(first[1].lower()))
    ):
        yield at[0], "no-verb", at[1]


def begins_sentence(word: str) -> bool:
    """Return whether a word is one of VERBS, or its third person."""
    if word in NOUNS:
        return False
    stems = {word, word.removesuffix("s"), word.removesuffix("es"), re.sub("ies$", "y", word)}
    return word == "has" or bool(stems & VERBS)


def check_test_name(node: ast.FunctionDef | ast.AsyncFunctionDef) -> Iterator[Problem]:
    """Yield the problem of a test's name, if it has one."""
    name = node.name.removeprefix("test_")
    if name.count("_") < 2 or NO_SUBJECT.match(name):
        yield node.lineno, "test-name", node.name


def check_name(line: int, name: str) -> Iterator[Problem]:
    """Yield the coined words of a name in snake case or camel case."""
    for word in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", name):
        if word.lower() in COINED:
            yield line, "coined-name", f"{name}: {COINED[word.lower()]}"


def comments(text: str) -> Iterator[tokenize.TokenInfo]:
    """Yield the first line of each comment of a Python file."""
    last = -1
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            alone = token.line.lstrip().startswith("#")
            if not (alone and token.start[0] == last + 1):
                yield token
            last = token.start[0] if alone else -1


def check_comments(lines: Iterator[tuple[int, str]]) -> Iterator[Problem]:
    """Yield the comments that begin with a word that leaves them without a subject."""
    for line, text in lines:
        if OPENER.match(text.lstrip("/<!#: ")):
            yield line, "opener", text


DECLARED = re.compile(
    r"^\s*(?:template\s*<[^>]*>\s*)?(?:class|struct|enum class)\s+(\w+)|^\s*(?:[\w:<>&*,]+\s+)+[&*]?(\w+)\("
)
CONSTANT = re.compile(r"constexpr\s+(?:double|int|Index|std::size_t|float|long)\s+([^;]*\d[^;]*);(.*)")
NAMED = re.compile(r"\b(?:double|float)\s+\w+\s*=\s*[-+]?[\d.]+(?:e[-+]?\d+)?\s*[;,)]")
DECIMAL = re.compile(r"(?<![\w.])(\d+\.\d*(?:e[-+]?\d+)?|\d+e[-+]?\d+)(?![\w.])")
MESSAGE = re.compile(r'(?:InvalidInput\(|reason = |fail\()"([^"]+)"')


def check_cpp(name: str, text: str) -> Iterator[Problem]:
    """Yield the problems of a C++ file, which is read line by line."""
    yield from check_name(1, Path(name).stem)
    lines = text.splitlines()
    said = [(i, line.partition("//")[2]) for i, line in enumerate(lines, 1) if "//" in line]
    alone = {i for i, line in enumerate(lines, 1) if line.lstrip().startswith("//")}
    yield from check_comments((i, each) for i, each in said if not (i in alone and i - 1 in alone))
    for i, line in enumerate(lines, 1):
        code = line.partition("//")[0]
        declared = DECLARED.match(code) if name.endswith(".h") else None
        if declared and not code.lstrip().startswith(("return", "if", "else", "for")):
            yield from check_name(i, declared[1] or declared[2])
        message = MESSAGE.search(line)
        if message and INSIDE.search(message[1]) and "/linalg/" not in name:
            yield i, "inside-message", message[1]
        if not name.startswith(SOLVERS):
            continue
        if constant := CONSTANT.search(line):
            above = lines[i - 2].strip() if i > 1 else ""
            comment = constant[2].strip() + (above if above.startswith("//") else "")
            if "//" not in comment or "test_" not in comment:
                yield i, "unexplained-constant", constant[1]
        elif "constexpr" not in line and not NAMED.search(code):
            for number in DECIMAL.findall(code):
                if float(number) not in PLAIN_NUMBERS:
                    yield i, "bare-number", f"{number} in {line.strip()}"


def check_manual(name: str, text: str) -> Iterator[Problem]:
    """Yield the long sentences of a page, without its code, tables and headings."""
    text = re.sub(r"```.*?```", lambda block: "\n" * block[0].count("\n"), text, flags=re.S)
    paragraph: list[str] = []
    start = 1
    for i, line in enumerate([*text.splitlines(), ""], 1):
        plain = line.strip()
        if plain and not plain.startswith(("|", "#", "- ", "![", "1.")):
            start = start if paragraph else i
            paragraph.append(plain)
            continue
        for sentence in re.split(r"(?<=[.:?!])\s+(?=[A-Z`*])", " ".join(paragraph)):
            if len(sentence.split()) > 40:
                yield start, "long-sentence", sentence
        paragraph, start = ([plain[2:]] if plain.startswith("- ") else []), i


def commit_subjects(root: Path, count: int) -> Iterator[Finding]:
    """Yield the subjects among the last commits, that are no imperative or too long; `part: ` may stand before."""
    if not count:
        return
    log = ["git", "log", f"-{count}", "--no-merges", "--format=%h%x09%s"]
    for row in subprocess.run(log, cwd=root, capture_output=True, text=True, check=True).stdout.splitlines():
        commit, _, subject = row.partition("\t")
        first = re.match(r"(?:[\w/ ,-]+: )?(\w+)", subject)
        if len(subject) > 72 or not first or first[1].lower() not in VERBS:
            yield Finding(commit, 0, "commit-subject", subject)


if __name__ == "__main__":
    sys.exit(main())
