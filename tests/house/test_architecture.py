"""The shape of the code: floors of the C++ core, rooms of the Python package, who may see which library, file lengths,
light imports, and solvers that ask for no kind of body."""

import ast
import graphlib
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

# A file includes files of its own floor and of lower ones.
FLOORS = {
    "magshell/core": 0,
    "magshell/mesh": 1,
    "magshell/linalg": 1,
    "magshell/linalg/krylov": 1,
    "magshell/linalg/multifrontal": 1,
    "magshell/linalg/ordering": 1,
    "magshell/strain": 2,
    "magshell/energy": 2,
    "magshell/contact": 2,
    "magshell/force": 2,
    "magshell/field": 2,
    "magshell/obstacle": 2,
    "magshell/picture": 2,
    "magshell/body": 3,
    "magshell/dofs": 4,
    "magshell/assembly": 4,
    "magshell/terms": 5,
    "magshell/terms/actuator": 5,
    "magshell/terms/contact": 5,
    "magshell/terms/joint": 5,
    "magshell/terms/load": 5,
    "magshell/terms/magnetic": 5,
    "magshell/terms/shell": 5,
    "magshell/terms/shell6": 5,
    "magshell/terms/solid": 5,
    "magshell/scene": 6,
    "magshell/solve": 7,
    "magshell/solve/globalization": 7,
    "magshell/solve/motion": 7,
    "magshell/solve/newton": 7,
    "magshell/solve/projective": 7,
    "magshell/adjoint": 8,
    "bindings": 9,
    "bindings/testing": 9,
}
# Rooms of the Python package from the lowest up, with the modules that stand beside them; a room within a room has a
# dot. A file imports its own room and lower ones, within functions too. `__init__` is the package as users see it.
ROOMS = [
    "_core",
    "errors",
    "_runtime",
    "_input",
    "mesh",
    "model",
    "model.fields",
    "model.shells",
    "model.solids",
    "model.rigid",
    "model.bodies",
    "model.supports",
    "model.loads",
    "model.contact",
    "model.actuators",
    "model.results",
    "model.scene",
    "solve",
    "solve.options",
    "solve.adjoint",
    "solve.statics",
    "solve.dynamics",
    "solve.linear",
    "solve.accuracy",
    "design",
    "output",
    "output.results",
    "output.plot",
    "output.live",
    "envs",
    "jax",
    "__init__",
    "__main__",
]
OFFERED_ROOMS = {"envs", "jax"}  # as ms.envs, ms.jax
# Imports of a higher room, each with its reason.
UPWARD_IMPORTS = {
    # Only autograd.py may see torch.autograd, which says what transforms a tensor is in. Asked for once torch is loaded.
    ("_input/tensor_kinds.py", "solve.adjoint.autograd"),
}
# Libraries that one folder hides from the others: a pattern of the include, and the folder.
HIDDEN_HEADERS = {r"pybind11/|Python\.h": "bindings", r"(?i)cholmod": "magshell/linalg"}
# Solvers ask what a scene is capable of (scene/model_capabilities.h), never what it is made of.
SOLVERS = ("magshell/solve", "magshell/adjoint")
KIND_QUESTIONS = re.compile(
    r"\bmodel(?:_|\(\))?(?:\.|->)(?:terms|n_muscles|has_\w+|(?:body_)?contact|solid_term|muscle_term|elastic_term)\("
    r"|\bbodies\(\)\.(?:shells|solids|six_node_\w+|fibres|faces|rigid_\w+)\("
    r"|\b(?:low_rank|elastic|dampers)\(\)\.empty\("
    r"|\bdynamic_cast\b|\btypeid\b|\bname\(\)\s*[!=]="
)
TERMS_OF_SOLVERS = {"magshell/terms/contact/contacts.h", "magshell/terms/contact/pair_stiffness.h"}
# Modules that some rooms or files of the package hide from the others.
HIDDEN_MODULES = {
    "torch.autograd": ("solve/adjoint/autograd.py", "solve/adjoint/energy_autograd.py"),
    "matplotlib": ("output/plot/",),
    "pyvista": ("output/plot/",),
    "viser": ("output/live/",),
    "pxr": ("output/plot/",),
    "gymnasium": ("envs/",),
    "jax": ("jax/",),
}
OPTIONAL_MODULES = (
    "torch matplotlib pyvista PIL imageio_ffmpeg meshio gmsh magpylib ipctk distributed cloudpickle gymnasium pandas xarray "
    "jax viser pxr"
).split()
LONGEST_FILE = 600
SPELLINGS = {"cent" + "re": "center"}  # in two halves, as this file is read as well


def cpp_files(root: Path) -> list[Path]:
    return sorted(path for path in (root / "cpp").rglob("*") if path.suffix in {".h", ".cpp"})


def python_files(root: Path, *folders: str) -> list[Path]:
    return sorted(path for folder in folders for path in (root / folder).rglob("*.py"))


def includes(path: Path) -> list[tuple[str, str]]:
    """Return (delimiter, name) of each include, with the delimiter '"' or '<'."""
    return re.findall(r'^\s*#\s*include\s*(["<])([^">]+)[">]', path.read_text(), re.MULTILINE)


def folder_of(name: str) -> str:
    return name.rpartition("/")[0]


def include_violations(root: Path) -> Iterator[str]:
    for path in cpp_files(root):
        file = path.relative_to(root / "cpp").as_posix()
        if folder_of(file) not in FLOORS:
            yield f"{file}: its folder has no floor"
            continue
        for delimiter, name in includes(path):
            if folder_of(name) in FLOORS:
                if FLOORS[folder_of(name)] > FLOORS[folder_of(file)]:
                    yield f"{file} includes {name}, of a higher floor"
            elif delimiter == '"':
                yield f"{file} includes {name}, which is not a path from cpp/"
            for pattern, owner in HIDDEN_HEADERS.items():
                if re.search(pattern, name) and folder_of(file) != owner and folder_of(name) not in FLOORS:
                    yield f"{file} includes {name}, which only {owner}/ may"


def kind_violations(root: Path) -> Iterator[str]:
    for path in cpp_files(root):
        file = path.relative_to(root / "cpp").as_posix()
        if not file.startswith(SOLVERS):
            continue
        for number, line in enumerate(path.read_text().splitlines(), 1):
            if question := KIND_QUESTIONS.search(line.split("//")[0]):
                yield f"{file}:{number} asks for a kind of body or term: {question[0]}"
        for _, name in includes(path):
            if name.startswith("magshell/terms/") and name not in TERMS_OF_SOLVERS:
                yield f"{file} includes {name}: a solver asks for no kind of body or term"


def imported_names(path: Path) -> Iterator[str]:
    """Yield the dotted names that a file imports, or reaches through a module (`torch.autograd.Function`)."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Attribute):
            yield ast.unparse(node)


def import_violations(root: Path) -> Iterator[str]:
    package = root / "python" / "magshell"
    for path in python_files(root, "python/magshell"):
        file = path.relative_to(package).as_posix()
        for name in imported_names(path):
            for module, only in HIDDEN_MODULES.items():
                if (name == module or name.startswith(f"{module}.")) and not file.startswith(only):
                    yield f"{file} imports {name}, which only {' and '.join(only)} may"


def run_nodes(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes of a file that are executed, without the imports for type checkers only."""
    yield node
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.If) and ast.unparse(child.test) == "TYPE_CHECKING":
            for other in child.orelse:
                yield from run_nodes(other)
        else:
            yield from run_nodes(child)


def own_imports(path: Path, package: Path) -> Iterator[str]:
    """Yield the modules of the package that a file imports anywhere: "mesh.io" or "errors"; "__init__" is the whole
    package.
    """
    here = path.relative_to(package).parent.parts
    for node in run_nodes(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            dotted = [alias.name.split(".") for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            above = ["magshell", *here[: len(here) + 1 - node.level]] if node.level else []
            base = above + (node.module or "").split(".") if node.module else above
            dotted = [[*base, alias.name] for alias in node.names]
        else:
            continue
        for parts in dotted:
            if parts[0] == "magshell":
                yield module_of(parts[1:], package)


def room_of(parts: list[str]) -> str:
    """Return the room of a dotted name: model.shells, or mesh."""
    inner = ".".join(parts[:2])
    return inner if inner in ROOMS else parts[0]


def module_of(parts: list[str], package: Path) -> str:
    """Return the file or folder of a dotted name, as deep as one exists; at least its room."""
    if not parts or parts[0] not in {room.split(".")[0] for room in ROOMS}:
        return "__init__"
    places = [package.joinpath(*parts[:n]) for n in range(len(parts), 0, -1)]
    found = next((each for each in places if each.with_suffix(".py").is_file() or each.is_dir()), places[-1])
    return ".".join(found.relative_to(package).parts)


def room_violations(root: Path) -> Iterator[str]:
    package = root / "python" / "magshell"
    for path in python_files(root, "python/magshell"):
        file = path.relative_to(package).as_posix()
        room = room_of(file.removesuffix(".py").split("/"))
        if room not in ROOMS:
            yield f"{file}: its room has no place in the order"
            continue
        for name in own_imports(path, package):
            if (file, name) in UPWARD_IMPORTS:
                continue
            if room_of(name.split(".")) not in ROOMS[: ROOMS.index(room) + 1]:
                yield f"{file} imports {name}, of a higher room"


def circle_violations(root: Path) -> Iterator[str]:
    """Yield the files that import each other, in whatever order they are loaded."""
    package = root / "python" / "magshell"
    needed = {}
    for path in python_files(root, "python/magshell"):
        file = path.relative_to(package).as_posix()
        if path.name not in ("__init__.py", "__main__.py"):
            upward = {name for each, name in UPWARD_IMPORTS if each == file}
            needed[file.removesuffix(".py").replace("/", ".")] = set(own_imports(path, package)) - upward
    try:
        graphlib.TopologicalSorter(needed).prepare()
    except graphlib.CycleError as error:
        yield f"imports in a circle: {' -> '.join(error.args[1])}"


def hidden_violations(root: Path) -> Iterator[str]:
    """Yield the functions that a package exports under the name of one of its modules, which hides that module."""
    package = root / "python" / "magshell"
    for path in package.rglob("__init__.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            for alias in node.names if isinstance(node, ast.ImportFrom) and node.module else ():
                name = alias.asname or alias.name
                if name == "*":
                    yield f"{path.relative_to(package)} imports * from {node.module}"
                elif (
                    name == node.module
                    or path.with_name(f"{name}.py").exists()
                    or path.with_name(name).is_dir()
                ):
                    yield f"{path.relative_to(package)}: {name} hides a module"


def length_violations(root: Path) -> Iterator[str]:
    for path in cpp_files(root) + python_files(root, "python", "tests", "examples"):
        length = len(path.read_text().splitlines())
        if length > LONGEST_FILE:
            yield f"{path.relative_to(root)} has {length} lines"


def spelling_violations(root: Path) -> Iterator[str]:
    for path in cpp_files(root) + python_files(root, "python", "tests", "examples"):
        for number, line in enumerate(path.read_text().splitlines(), 1):
            for word, right in SPELLINGS.items():
                if word in line.lower():
                    yield f"{path.relative_to(root)}:{number}: {word} is spelled {right} here"


RULES = [
    include_violations,
    kind_violations,
    import_violations,
    room_violations,
    circle_violations,
    hidden_violations,
    length_violations,
    spelling_violations,
]


@pytest.mark.parametrize("rule", RULES)
def test_rule_holds_in_the_tree(rule) -> None:
    assert list(rule(ROOT)) == []


def test_the_rules_look_at_files() -> None:
    assert cpp_files(ROOT) and python_files(ROOT, "python/magshell")


@pytest.mark.parametrize(
    ("rule", "file", "text", "complaint"),
    [
        (include_violations, "cpp/magshell/mesh/a.h", '#include "magshell/solve/b.h"\n', "higher floor"),
        (include_violations, "cpp/magshell/mesh/a.h", '#include "../solve/b.h"\n', "not a path from cpp/"),
        (include_violations, "cpp/magshell/plans/a.h", "", "no floor"),
        (include_violations, "cpp/magshell/solve/a.cpp", "#include <pybind11/numpy.h>\n", "only bindings/"),
        (
            include_violations,
            "cpp/magshell/solve/a.cpp",
            "#include <suitesparse/cholmod.h>\n",
            "only magshell/linalg/",
        ),
        (
            include_violations,
            "cpp/magshell/solve/a.cpp",
            "#  include <Eigen/CholmodSupport>\n",
            "only magshell/linalg/",
        ),
        (kind_violations, "cpp/magshell/solve/a.cpp", "if (model_.n_muscles() == 0) {}\n", "kind of body"),
        (
            kind_violations,
            "cpp/magshell/solve/a.h",
            "return model.bodies().solids().empty();\n",
            "kind of body",
        ),
        (
            kind_violations,
            "cpp/magshell/adjoint/a.cpp",
            "newton.model().has_body_contact();\n",
            "kind of body",
        ),
        (kind_violations, "cpp/magshell/solve/a.cpp", "model.low_rank().empty();\n", "kind of body"),
        (
            kind_violations,
            "cpp/magshell/solve/a.cpp",
            '#include "magshell/terms/solid/solid_term.h"\n',
            "kind of body",
        ),
        (
            import_violations,
            "python/magshell/solve/statics/solve.py",
            "from torch import autograd\n",
            "only solve/adjoint/autograd.py and solve/adjoint/energy_autograd.py may",
        ),
        (
            import_violations,
            "python/magshell/solve/adjoint/static.py",
            "class A(torch.autograd.Function): ...\n",
            "only solve/adjoint/autograd.py and solve/adjoint/energy_autograd.py may",
        ),
        (
            import_violations,
            "python/magshell/mesh/vtu.py",
            "def f():\n    import pyvista as pv\n",
            "only output/plot/ may",
        ),
        (room_violations, "python/magshell/attic/a.py", "", "no place"),
        (
            room_violations,
            "python/magshell/mesh/a.py",
            "from .._core import scene\nfrom ..model.scene import b\n",
            "higher room",
        ),
        (
            room_violations,
            "python/magshell/mesh/a.py",
            "def f():\n    from ..solve import statics\n",
            "higher room",
        ),
        (
            room_violations,
            "python/magshell/mesh/a.py",
            "if TYPE_CHECKING:\n    pass\nelse:\n    from ..solve import statics\n",
            "higher room",
        ),
        (
            room_violations,
            "python/magshell/mesh/a.py",
            "def f():\n    import magshell as ms\n",
            "higher room",
        ),
        (room_violations, "python/magshell/errors.py", "from magshell import mesh\n", "higher room"),
        (
            circle_violations,
            "python/magshell/mesh/a.py",
            "def f():\n    from .a import g\n",
            "mesh.a -> mesh.a",
        ),
        (hidden_violations, "python/magshell/__init__.py", "from .mesh import *\n", "imports *"),
        (hidden_violations, "python/magshell/mesh/__init__.py", "from .weld import weld\n", "hides a module"),
        (length_violations, "tests/test_long.py", "\n" * (LONGEST_FILE + 1), f"{LONGEST_FILE + 1} lines"),
        (spelling_violations, "tests/test_a.py", f"x = bary{next(iter(SPELLINGS))}s\n", "spelled center"),
    ],
)
def test_rule_sees_a_violation(tmp_path: Path, rule, file: str, text: str, complaint: str) -> None:
    path = tmp_path / file
    path.parent.mkdir(parents=True)
    path.write_text(text)
    complaints = list(rule(tmp_path))
    assert complaints and all(complaint in each for each in complaints)


@pytest.mark.parametrize(
    ("file", "text"),
    [
        (
            "cpp/magshell/mesh/a.h",
            '#include <vector>\n#include "magshell/core/types.h"\n#include "magshell/linalg/b.h"\n',
        ),
        (
            "cpp/magshell/solve/a.cpp",
            "if (model_.capabilities().has_barrier) {}  // not model_.n_muscles()\n",
        ),
        ("cpp/magshell/linalg/cholmod.cpp", '#include <cholmod.h>\n#include "magshell/linalg/cholmod.h"\n'),
        ("cpp/bindings/solve.cpp", '#include <pybind11/stl.h>\n#include "magshell/linalg/cholmod.h"\n'),
        ("python/magshell/output/plot/html.py", "import pyvista\nfrom matplotlib import pyplot\n"),
        (
            "python/magshell/solve/adjoint/autograd.py",
            "from torch.autograd.function import once_differentiable\n",
        ),
        (
            "python/magshell/output/results/a.py",
            "from ... import _core, errors\nfrom ...mesh import io\nfrom . import b\n",
        ),
    ],
)
def test_rules_let_good_code_through(tmp_path: Path, file: str, text: str) -> None:
    path = tmp_path / file
    path.parent.mkdir(parents=True)
    path.write_text(text)
    assert [complaint for rule in RULES for complaint in rule(tmp_path)] == []


def test_users_are_not_led_into_the_bench_or_the_rooms() -> None:
    code = "import sys, magshell; print(*dir(magshell), *(name for name in sys.modules if '.bench' in name))"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    names = run.stdout.split()
    assert "Scene" in names and "equilibrium" in names
    assert not [
        name
        for name in names
        if "bench" in name or (name in {room.split(".")[0] for room in ROOMS} and name not in OFFERED_ROOMS)
    ]


def test_import_needs_no_optional_module() -> None:
    code = f"import sys, magshell; print(*(name for name in {OPTIONAL_MODULES} if name in sys.modules))"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.split() == []
