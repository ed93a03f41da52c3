"""Names that are local to files compiled as one translation unit are distinct within a folder.

Two constants of the same name would not compile. Of two functions of the same name with different parameters, the wrong
one might be called without any message.
"""

import re
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).parents[2]
ASIDE = re.compile(r"//[^\n]*|/\*.*?\*/|\"(?:\\.|[^\"\\\n])*\"|^[ \t]*#[^\n]*", re.DOTALL | re.MULTILINE)
TYPE = re.compile(r"\b(?:struct|class|enum(?:\s+class)?|using(?=\s+\w+\s*=))\s+(\w+)")
OTHER = re.compile(r"([A-Za-z_]\w*)\s*(?:\(|=|\{|\[|$)")


def folders() -> dict[str, set[str]]:
    """Return the files of each folder that are compiled alone, as CMakeLists.txt lists them."""
    build = (ROOT / "CMakeLists.txt").read_text()
    calls = re.findall(r"^ *compile_together\(\w+ (\S+) \d+([^)]*)\)", build, re.MULTILINE)
    return {folder: set(alone.split()) for folder, alone in calls}


def outermost(text: str) -> str:
    """Return the text of a namespace without the contents of inner braces."""
    depth, kept = 1, []
    for sign in text:
        depth += {"{": 1, "}": -1}.get(sign, 0)
        if depth == 0:
            break
        if depth == 1:
            kept.append("{};" if sign == "}" else sign)
    return "".join(kept)


def local_names(text: str) -> set[str]:
    """Return the names of types, constants and functions in anonymous namespaces."""
    text = ASIDE.sub(" ", text)
    names = set()
    for opened in re.finditer(r"\bnamespace\s*\{", text):
        for statement in outermost(text[opened.end() :]).split(";"):
            plain = re.sub(r"\btemplate\s*<[^;{]*?>(?=\s*[a-zA-Z])", " ", statement).strip()
            found = TYPE.search(plain) or OTHER.search(plain)
            # neither a member of a class nor a using-declaration
            if found and not plain[: found.start(1)].endswith("::"):
                names.add(found[1])
    return names


def test_local_names_are_found() -> None:
    text = """
    namespace a { namespace {
    constexpr double small = 1e-3;  // other = 4
    struct Part { int inner = 0; };
    template <typename T> T twice(T x) { const T mine = x; return 2 * mine; }
    std::vector<int> rows{1, 2};
    using other::Name;
    using Short = std::vector<int>;
    int Part::member(int x) { return x; }
    } void shared() {} }
    """
    assert local_names(text) == {"small", "Part", "twice", "rows", "Short"}


def test_no_two_files_share_a_local_name() -> None:
    compiled = folders()
    assert {"magshell/scene", "magshell/solve", "bindings"} <= set(compiled)
    found = 0
    for folder, alone in compiled.items():
        owners = defaultdict(list)
        for path in sorted((ROOT / "cpp" / folder).glob("*.cpp")):
            if path.name not in alone:
                for name in local_names(path.read_text()):
                    owners[name].append(path.name)
        assert {name: files for name, files in owners.items() if len(files) > 1} == {}, folder
        found += len(owners)
    assert found > 150
