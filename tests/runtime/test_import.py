"""Speed of `import magshell`: slow modules are loaded at their first use. The tests check modules, not times."""

import subprocess
import sys

# Modules of the standard library and of magshell's requirements.
LATE = {
    *(
        "scipy.sparse",
        "scipy.spatial",
        "scipy.linalg",
        "scipy.interpolate",
        "scipy.optimize",
        "scipy.special",
    ),
    *("tqdm", "difflib", "xml.sax", "urllib.request", "email", "concurrent.futures.process", "asyncio"),
}
FOUND = ("numpy", "scipy")  # all that is loaded of other packages; of scipy only what finds its parts


def test_import_brings_numpy_and_little_else():
    code = "import sys; before = set(sys.modules); import magshell; print(*(set(sys.modules) - before))"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    names = set(run.stdout.split())
    assert "magshell.solve.statics.solve" in names and not names & LATE
    others = {name.split(".")[0] for name in names} - set(sys.stdlib_module_names)
    assert {name for name in others if not name.startswith("_")} <= {"magshell", *FOUND, "cython_runtime"}
