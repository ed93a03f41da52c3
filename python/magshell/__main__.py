"""python -m magshell: what is installed, whether it computes right, and how to cite it."""

from __future__ import annotations

import importlib.util
import sys

import magshell as ms

_EXTRAS = {
    "torch": ("torch",),
    "plot": ("matplotlib", "pyvista"),
    "movie": ("imageio_ffmpeg",),
    "io": ("meshio",),
    "gmsh": ("gmsh",),
    "magpylib": ("magpylib",),
    "urdf": ("yourdfpy",),
    "tables": ("pandas", "xarray"),
    "gym": ("gymnasium",),
}
_CITE = """To cite magshell (CITATION.cff in the sources):
  The magshell developers. magshell: simulation and gradient-based design of thin shells of hard-magnetic soft material.
  Version {version}.
and the papers whose methods it implements:
  X. Chen, X. Ni, B. Zhu, B. Wang, B. Chen. Simulation and Optimization of Magnetoelastic Thin Shells. ACM Transactions on
  Graphics 41(4), article 61, 2022. doi:10.1145/3528223.3530142
  Y.-L. Qiao, J. Liang, V. Koltun, M. C. Lin. Differentiable Simulation of Soft Multi-body Systems. NeurIPS 2021."""


def main() -> int:
    """Prints all three; 1 where a check fails."""
    ms.show_config()
    there = {name: all(map(importlib.util.find_spec, modules)) for name, modules in _EXTRAS.items()}
    for label, wanted in (("extras here", True), ("extras not here", False)):
        print(f"{label}: {', '.join(name for name, found in there.items() if found is wanted) or 'none'}")
    print()
    checks = {
        "a clamped strip hangs as a beam does": _hanging,
        "a gradient is that of differences": _gradient,
    }
    failed = 0
    for name, check in checks.items():
        told = "torch is not here" if check is _gradient and not there["torch"] else check()
        failed += told.startswith("WRONG")
        print(f"{name}: {told}")
    print("\n" + _CITE.format(version=ms.__version__))
    return int(failed > 0)


def _strip() -> tuple[ms.Scene, object]:
    mesh = ms.meshes.rectangle(0.1, 0.01, cells=(40, 4))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e9, poisson_ratio=0.0, mass_density=1e3)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    return scene, mesh.vertices_at(x=0.1)


def _hanging() -> str:
    scene, tip = _strip()
    sag = -float(ms.equilibrium(scene).displacements[tip, 2].mean())
    theory = 12 * 1e3 * 9.81 * 0.1**4 / (8 * 1e9 * 1e-3**2)  # q L^4 / (8 E I)
    return _judged(sag / theory - 1.0, 2e-3)


def _gradient() -> str:
    import torch

    scene, tip = _strip()
    modulus = torch.tensor(1e9, dtype=torch.float64, requires_grad=True)
    ms.equilibrium(scene, young_modulus=modulus).positions[tip, 2].mean().backward()
    low, high = (
        ms.equilibrium(scene, young_modulus=1e9 * (1 + s)).positions[tip, 2].mean() for s in (-1e-4, 1e-4)
    )
    return _judged(modulus.grad.item() / (float(high - low) / 2e5) - 1.0, 1e-5)


def _judged(off: float, bound: float) -> str:
    return f"{'right' if abs(off) < bound else 'WRONG'}, {abs(off):.1e} off"


if __name__ == "__main__":
    sys.exit(main())
