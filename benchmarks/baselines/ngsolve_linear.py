"""NGSolve's Hellan-Herrmann-Johnson shells and plates of any order, to first order in the load.

Neunteufel and Schoeberl 2019, 2021: displacements of order k; moments of order k - 1, whose normal components are
made continuous by rotations of edges; and membrane strains interpolated by Regge elements of order k - 1. Moments
are condensed out element by element. At orders 1 and 2, with these integration points, the elements are those of
`midedge` and `midedge2`.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, NamedTuple

import ngsolve as ng
import numpy as np

from .ngsolve_mesh import at_vertices, by_axis


class Material(NamedTuple):
    """A shell's thickness [m], Young's modulus [Pa] and Poisson's ratio [-]."""

    thickness: float
    young_modulus: float
    poisson_ratio: float


class Solved(NamedTuple):
    """The result of a solve.

    displacements: (n_v, 3) m, or (n_v, 1) across a plate. seconds: processor time of assembly, factorization and
    solution. unknowns: those of the matrix.
    """

    displacements: np.ndarray
    seconds: float
    unknowns: int


def inside(order: int) -> Any:
    """Return dx or ds with the integration points of `midedge2` if the order is 2."""
    return {ng.TRIG: ng.IntegrationRule(ng.TRIG, 2 * order)}


def on_edges(order: int) -> Any:
    """Return the integration rule on edges that belongs to `inside`."""
    return {ng.SEGM: ng.IntegrationRule(ng.SEGM, 2 * order - 1)}


def shell(
    mesh: ng.Mesh,
    order: int,
    material: Material,
    fixed: dict[str, str],
    clamped: str,
    load: Callable[..., Any],
) -> Solved:
    """Solve a shell to first order in the load.

    fixed: {"x": names of border edges that do not move along x, "a|b"}; clamped: those that do not rotate.
    load(v): the work of the loads on displacements v, a sum of integrals; or {vertex: force (3,) N}.
    """
    t, modulus, nu = material
    displacements = ng.VectorH1(
        mesh, order=order, **{f"dirichlet{axis}_bbnd": names for axis, names in fixed.items()}
    )
    space = (
        displacements
        * ng.HDivDivSurface(mesh, order=order - 1, discontinuous=True)
        * ng.NormalFacetSurface(mesh, order=order - 1, dirichlet_bbnd=clamped)
    )
    regge = ng.HCurlCurl(mesh, order=order - 1, discontinuous=True)
    (u, moments, rotations), (v, tests, others) = space.TnT()
    moments, rotations, tests, others = (each.Trace() for each in (moments, rotations, tests, others))
    normal, along = ng.specialcf.normal(3), ng.specialcf.tangential(3)
    across = ng.Cross(normal, along)
    plane = ng.Id(3) - ng.OuterProduct(normal, normal)

    def strain(u):
        return ng.Interpolate(ng.Sym(plane * ng.Grad(u).Trace()), regge)

    def bent(u):
        return ng.CF(u.Operator("hesseboundary").trans * normal, dims=(3, 3))

    def relative_rotation(u, rotations):
        return normal * (ng.Grad(u).Trace() * across) - rotations * across

    first, second = strain(u), strain(v)
    form = ng.BilinearForm(space, symmetric=True, condense=True)
    stretched = (1 - nu) * ng.InnerProduct(first, second) + nu * ng.Trace(first) * ng.Trace(second)
    compliance = (1 + nu) * ng.InnerProduct(moments, tests) - nu * ng.Trace(moments) * ng.Trace(tests)
    inner = t * modulus / (1 - nu**2) * stretched - 12 / (modulus * t**3) * compliance
    inner += ng.InnerProduct(moments, bent(v)) + ng.InnerProduct(tests, bent(u))
    form += inner * ng.ds(intrules=inside(order))
    rim = relative_rotation(u, rotations) * ((tests * across) * across)
    rim += relative_rotation(v, others) * ((moments * across) * across)
    form += -rim * ng.ds(element_boundary=True, intrules=on_edges(order))
    return _solved(space, form, lambda: _work(space, displacements, load, v))


def plate(
    mesh: ng.Mesh, order: int, stiffness: float, nu: float, fixed: str, clamped: str, load: Callable[..., Any]
) -> Solved:
    """Solve the deflection of a flat plate on a mesh of dimension 2.

    stiffness: D, N m. fixed, clamped, load: as for a shell, for the single displacement.
    """
    deflections = ng.H1(mesh, order=order, dirichlet=fixed)
    space = (
        deflections
        * ng.HDivDiv(mesh, order=order - 1, discontinuous=True)
        * ng.NormalFacetFESpace(mesh, order=order - 1, dirichlet=clamped)
    )
    (w, moments, rotations), (v, tests, others) = space.TnT()
    normal = ng.specialcf.normal(2)
    form = ng.BilinearForm(space, symmetric=True, condense=True)
    compliance = (1 + nu) * ng.InnerProduct(moments, tests) - nu * ng.Trace(moments) * ng.Trace(tests)
    inner = ng.InnerProduct(moments, v.Operator("hesse")) + ng.InnerProduct(tests, w.Operator("hesse"))
    form += (inner - compliance / (stiffness * (1 - nu**2))) * ng.dx(intrules=inside(order))
    rim = (ng.Grad(w) - rotations) * normal * (tests * normal * normal)
    rim += (ng.Grad(v) - others) * normal * (moments * normal * normal)
    form += -rim * ng.dx(element_boundary=True, intrules=on_edges(order))
    return _solved(space, form, lambda: _work(space, deflections, load, v))


def _work(space, displacements, load, tests):
    """Return the load vector, from a linear form or from forces at vertices."""
    work = ng.LinearForm(space)
    if callable(load):
        work += load(tests)
    work.Assemble()
    if not callable(load):
        starts = np.cumsum([0, *(part.ndof for part in by_axis(displacements))])
        for vertex, force in load.items():
            for start, component in zip(starts, np.atleast_1d(force), strict=False):
                work.vec[int(start) + vertex] += float(component)
    return work.vec


def _solved(space, form, work: Callable[..., Any]) -> Solved:
    solution = ng.GridFunction(space)
    began = time.process_time()
    form.Assemble()
    right = work()
    inverse = form.mat.Inverse(space.FreeDofs(True), inverse="sparsecholesky")
    right.data += form.harmonic_extension_trans * right
    solution.vec.data = inverse * right
    solution.vec.data += form.harmonic_extension * solution.vec
    solution.vec.data += form.inner_solve * right
    seconds = time.process_time() - began
    return Solved(at_vertices(solution.components[0]), seconds, sum(space.FreeDofs(True)))
