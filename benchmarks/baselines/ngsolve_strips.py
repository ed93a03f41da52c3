"""Clamped strip through large rotations by NGSolve's shells of any order, as in its tutorial of nonlinear shells.

Neunteufel and Schoeberl 2019, 2021. The averaged normals at edges are computed again in each step of Newton's
method.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import ngsolve as ng

from .ngsolve_linear import Material, Solved, inside, on_edges
from .ngsolve_mesh import at_vertices

_MOST_STEPS = 40  # Newton iterations at one load


class DidNotConverge(Exception):
    """An error raised if Newton's method does not converge at one of the loads."""


def strip(
    mesh: ng.Mesh,
    order: int,
    material: Material,
    load: Callable[..., Any],
    loads: int,
    tolerance: float = 1e-13,
) -> Solved:
    """Solve a strip that is flat at rest in the plane z = 0, clamped at the edges named "left", with zero Poisson's
    ratio.

    load(load_factor, u, deformed): the energy of the loads times a factor, at the displacements u and the deformation
    gradient, a sum of integrals. loads: number of equal load steps, from rest. tolerance: energy of the last Newton step
    over that of the first. seconds: of all steps, without setting up the forms.
    """
    if material.poisson_ratio != 0.0:
        raise ValueError(f"the strip must have a Poisson's ratio of 0, got {material.poisson_ratio}")
    displacements = ng.VectorH1(mesh, order=order, dirichlet_bbnd="left")
    space = (
        displacements
        * ng.HDivDivSurface(mesh, order=order - 1, discontinuous=True)
        * ng.NormalFacetSurface(mesh, order=order - 1, dirichlet_bbnd="left")
    )
    u, moments, rotations = space.TrialFunction()
    moments, rotations = moments.Trace(), rotations.Trace()
    solution = ng.GridFunction(space)
    rest_normal, along = ng.specialcf.normal(3), ng.specialcf.tangential(3)
    rest_across = ng.Cross(rest_normal, along)
    plane = ng.Id(3) - ng.OuterProduct(rest_normal, rest_normal)
    deformed = ng.Grad(u).Trace() + plane
    normal = ng.Normalize(ng.Cof(deformed) * rest_normal)
    tangent = ng.Normalize(deformed * along)
    across = ng.Cross(normal, tangent)
    curvature = ng.CF(u.Operator("hesseboundary").trans * normal, dims=(3, 3))
    mean = _Mean(mesh, order, ng.Normalize(ng.Cof(plane + ng.Grad(solution.components[0])) * rest_normal))
    projected = ng.Normalize(mean.now - (tangent * mean.now) * tangent)

    t, modulus, _ = material
    load_factor = ng.Parameter(0.0)
    energy = ng.BilinearForm(space, symmetric=True, condense=True)
    green = 0.5 * (deformed.trans * deformed - plane)
    strain = ng.Interpolate(green, ng.HCurlCurl(mesh, order=order - 1, discontinuous=True))
    energy += ng.Variation(0.5 * t * modulus * ng.InnerProduct(strain, strain) * ng.ds)
    bent = ng.InnerProduct(moments, curvature) - 6 / (modulus * t**3) * ng.InnerProduct(moments, moments)
    energy += ng.Variation(bent * ng.ds(intrules=inside(order)))
    turned = ng.acos(rest_across * mean.at_rest) - ng.acos(across * projected) - rotations * rest_across
    at_edges = ng.ds(element_boundary=True, intrules=on_edges(order))
    energy += ng.Variation(-turned * ((moments * rest_across) * rest_across) * at_edges)
    energy += ng.Variation(load(load_factor, u, deformed))

    began = time.process_time()
    for k in range(loads):
        load_factor.Set((k + 1) / loads)
        _newton(energy, solution, mean, tolerance)
    seconds = time.process_time() - began
    return Solved(at_vertices(solution.components[0]), seconds, sum(space.FreeDofs(True)))


def _newton(energy: ng.BilinearForm, solution: ng.GridFunction, mean: _Mean, tolerance: float) -> None:
    """Solve for equilibrium at one load by Newton's method. Raises DidNotConverge."""
    residual, right, step = (solution.vec.CreateVector() for _ in range(3))
    free = solution.space.FreeDofs(True)
    first = None
    for _ in range(_MOST_STEPS):
        mean.take()
        energy.Apply(solution.vec, residual)
        energy.AssembleLinearization(solution.vec)
        right.data = residual
        right.data += energy.harmonic_extension_trans * residual
        step.data = energy.mat.Inverse(free, inverse="sparsecholesky") * right
        step.data += energy.harmonic_extension * step
        step.data += energy.inner_solve * residual
        solution.vec.data -= step
        won = abs(ng.InnerProduct(step, residual))
        first = won if first is None else first
        if won <= tolerance * first:
            return
        if not won < 1e12 * first:
            break
    raise DidNotConverge(f"{_MOST_STEPS} steps of Newton's method, the last wins {won:.3g} J")


class _Mean:
    """The averaged normals of both sides of an edge; on clamped edges those at rest."""

    def __init__(self, mesh: ng.Mesh, order: int, normal):
        space = ng.VectorFacetSurface(mesh, order=order)
        b = space.TrialFunction()
        self._found, at_rest = ng.GridFunction(space), ng.GridFunction(space)
        clamped = ng.GridFunction(ng.FacetSurface(mesh, order=0))
        clamped.Set(1, definedon=mesh.BBoundaries("left"))
        on_edges = ng.ds(element_boundary=True)
        self._form = ng.BilinearForm(space, symmetric=True)
        self._form += ng.Variation(0.5 * b * b * on_edges)
        towards = (1 - clamped) * normal + clamped * ng.specialcf.normal(3)
        self._form += ng.Variation(-towards * b * on_edges)
        self._matrix = None
        self.take()
        at_rest.vec.data = self._found.vec
        self.now, self.at_rest = (ng.Normalize(ng.CF(each.components)) for each in (self._found, at_rest))

    def take(self) -> None:
        """Compute the averages for the current deformation."""
        rest = self._found.vec.CreateVector()
        self._form.Apply(self._found.vec, rest)
        if self._matrix is None:  # it does not depend on the deformation
            self._form.AssembleLinearization(self._found.vec)
            self._matrix = self._form.mat.Inverse(self._form.space.FreeDofs(), inverse="sparsecholesky")
        self._found.vec.data -= self._matrix * rest
