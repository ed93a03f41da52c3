"""Second-order shells beside NGSolve's of order 2 with Regge's elements of order 1: the same to round-off.

An extra: NGSolve is not among what the tests need (pip install ngsolve, and run this file).
"""

import numpy as np
import pytest

import magshell as ms

ng = pytest.importorskip("ngsolve", reason="NGSolve is installed by hand where these are to run")
netgen = pytest.importorskip("netgen.meshing", reason="comes with NGSolve")


def borders(faces: np.ndarray) -> np.ndarray:
    """(k, 2)."""
    edges = np.sort(faces[:, [(0, 1), (1, 2), (2, 0)]].reshape(-1, 2), axis=1)
    once, counts = np.unique(edges, axis=0, return_counts=True)
    return once[counts == 1]


def netgen_mesh(dim: int, mesh: ms.TriangleMesh, names: dict):
    """names: {name: of which edges on the border, a function of their middles}, the last one for all others."""
    points, faces = mesh.rest_positions, mesh.faces
    made = netgen.Mesh(dim=dim)
    nodes = [made.Add(netgen.MeshPoint(netgen.Pnt(*map(float, point)))) for point in points]
    made.Add(netgen.FaceDescriptor(surfnr=1, domin=1, bc=1))
    for face in faces:
        made.Add(netgen.Element2D(1, [nodes[k] for k in face]))
    for a, b in borders(faces):
        middle = 0.5 * (points[a] + points[b])
        index = next(k for k, chosen in enumerate(names.values()) if chosen(middle))
        made.Add(netgen.Element1D([nodes[a], nodes[b]], index=index + 1))
    for k, name in enumerate(names):
        made.SetBCName(k, name) if dim == 2 else made.SetCD2Name(k + 1, name)
    if dim == 2:
        made.SetMaterial(1, "plate")
    return ng.Mesh(made)


@pytest.mark.parametrize("support", ["supported", "clamped"])
@pytest.mark.parametrize("cells", [2, 4, 8])
def test_plate_under_pressure(cells, support):
    """B5, to first order: a quarter of it, irregular, graded."""
    nu, thickness = 0.3, 0.01
    even = ms.meshes.rectangle(0.5, 0.5, (cells, cells), diagonals="crossed", irregular=0.25)
    points = even.rest_positions.copy()
    points[:, :2] = 0.5 * (2 * points[:, :2]) ** 1.3
    flat = ms.TriangleMesh(points, even.faces)
    mesh = ms.SixNodeMesh.of(flat)
    sheet = ms.Shell(
        mesh, thickness=thickness, young_modulus=12 * (1 - nu**2) / thickness**3, poisson_ratio=nu
    )
    rim = mesh.edges_where(lambda middles: middles[:, :2].max(axis=1) > 0.5 - 1e-9)
    held = ms.Clamp(rim) if support == "clamped" else ms.Pin(np.unique(mesh.nodes_of_edges[rim]))
    symmetry = [ms.SymmetryPlane((1, 0, 0)), ms.SymmetryPlane((0, 1, 0))]
    scene = ms.Scene(sheet, supports=[held, *symmetry], loads=[ms.AreaLoad((0, 0, 1.0))])
    found = ms.linear_response(scene).displacements[: flat.n_vertices, 2]

    names = {"rim": lambda x: x[:2].max() > 0.5 - 1e-9, "symmetry": lambda x: True}
    other = netgen_mesh(2, flat, names)
    deflections = ng.H1(other, order=2, dirichlet="rim")
    moments = ng.HDivDiv(other, order=1, dirichlet="rim" if support == "supported" else "")
    space = deflections * moments
    (w, m), (v, t) = space.TnT()
    normal = ng.specialcf.normal(2)

    def curvature(t, v):
        inside = -ng.InnerProduct(t, v.Operator("hesse")) * ng.dx
        return inside + ((t * normal) * normal) * (ng.Grad(v) * normal) * ng.dx(element_boundary=True)

    form = ng.BilinearForm(space, symmetric=True)
    compliance = ((1 + nu) * ng.InnerProduct(m, t) - nu * ng.Trace(m) * ng.Trace(t)) / (1 - nu**2)
    form += compliance * ng.dx + curvature(t, w) + curvature(m, v)
    form.Assemble()
    load = ng.LinearForm(-v * ng.dx).Assemble()
    solved = ng.GridFunction(space)
    solved.vec.data = form.mat.Inverse(space.FreeDofs()) * load.vec
    theirs = np.array([solved.components[0](other(*point[:2])) for point in points])
    theirs *= np.sign(theirs.sum())
    assert found == pytest.approx(theirs, abs=1e-9 * np.abs(theirs).max())


@pytest.mark.parametrize("cells", [(5, 1), (6, 2), (8, 2)])
def test_sheared_strip(cells):
    """A1 at its full load, through large rotations; NGSolve integrates by the same points."""
    thickness, modulus, force = 0.1, 1.2e6, 4.0
    flat = ms.meshes.rectangle(10, 1, cells=cells, irregular=0.25)
    mesh = ms.SixNodeMesh.of(flat)
    sheet = ms.Shell(mesh, thickness=thickness, young_modulus=modulus, poisson_ratio=0.0)
    scene = ms.Scene(
        sheet,
        supports=[ms.Clamp(mesh.edges_at(x=0.0))],
        loads=[ms.EdgeLoad(mesh.edges_at(x=10.0), (0, 0, force))],
    )
    found = ms.equilibrium(scene, solver=ms.MixedNewton(tolerance=1e-13)).displacements[: flat.n_vertices]
    names = {"left": lambda x: x[0] < 1e-9, "right": lambda x: x[0] > 10 - 1e-9, "free": lambda x: True}
    theirs = strip_by_ngsolve(netgen_mesh(3, flat, names), flat.rest_positions, thickness, modulus, force)
    assert found == pytest.approx(theirs, abs=1e-8)


def strip_by_ngsolve(mesh, points, thickness: float, modulus: float, force: float) -> np.ndarray:
    """Displacements at `points`, clamped on the left, a force per length on the right: Neunteufel and Schoeberl 2019, 2021,
    as in NGSolve's tutorial of nonlinear shells, with averaged normals found anew in each step."""
    places = ng.VectorH1(mesh, order=2, dirichlet_bbnd="left")
    space = (
        places
        * ng.HDivDivSurface(mesh, order=1, discontinuous=True)
        * ng.NormalFacetSurface(mesh, order=1, dirichlet_bbnd="left")
    )
    u, moments, turns = space.TrialFunction()
    moments, turns = moments.Trace(), turns.Trace()
    normals = ng.VectorFacetSurface(mesh, order=2)
    b, averaged, at_rest = normals.TrialFunction(), ng.GridFunction(normals), ng.GridFunction(normals)
    clamped = ng.GridFunction(ng.FacetSurface(mesh, order=0))
    clamped.Set(1, definedon=mesh.BBoundaries("left"))
    solution = ng.GridFunction(space)
    rest_normal, along = ng.specialcf.normal(3), ng.specialcf.tangential(3)
    rest_across = ng.Cross(rest_normal, along)
    plane = ng.Id(3) - ng.OuterProduct(rest_normal, rest_normal)
    gradient = ng.Grad(u).Trace() + plane
    green = 0.5 * (gradient.trans * gradient - plane)
    normal = ng.Normalize(ng.Cof(gradient) * rest_normal)
    tangent = ng.Normalize(gradient * along)
    across = ng.Cross(normal, tangent)
    curvature = ng.CF(u.Operator("hesseboundary").trans * normal, dims=(3, 3))
    now = ng.Normalize(ng.Cof(plane + ng.Grad(solution.components[0])) * rest_normal)
    mean = ng.Normalize(ng.CF(averaged.components))
    mean_at_rest = ng.Normalize(ng.CF(at_rest.components))
    projected = ng.Normalize(mean - (tangent * mean) * tangent)

    on_edges = ng.ds(element_boundary=True)
    average = ng.BilinearForm(normals, symmetric=True)
    average += ng.Variation(0.5 * b * b * on_edges)
    average += ng.Variation(-((1 - clamped) * now + clamped * rest_normal) * b * on_edges)

    def take_mean():
        rest = averaged.vec.CreateVector()
        average.Apply(averaged.vec, rest)
        average.AssembleLinearization(averaged.vec)
        averaged.vec.data -= average.mat.Inverse(normals.FreeDofs(), inverse="sparsecholesky") * rest

    take_mean()
    at_rest.vec.data = averaged.vec
    share = ng.Parameter(0.0)
    energy = ng.BilinearForm(space, symmetric=True, condense=True)
    strain = ng.Interpolate(green, ng.HCurlCurl(mesh, order=1, discontinuous=True))
    inside = ng.ds(intrules={ng.TRIG: ng.IntegrationRule(ng.TRIG, 4)})
    at_gauss = ng.ds(element_boundary=True, intrules={ng.SEGM: ng.IntegrationRule(ng.SEGM, 3)})
    energy += ng.Variation(0.5 * thickness * modulus * ng.InnerProduct(strain, strain) * ng.ds)
    compliance = -6 / (modulus * thickness**3) * ng.InnerProduct(moments, moments)
    energy += ng.Variation((compliance + ng.InnerProduct(moments, curvature)) * inside)
    turned = ng.acos(rest_across * mean_at_rest) - ng.acos(across * projected) - turns * rest_across
    energy += ng.Variation(-turned * ((moments * rest_across) * rest_across) * at_gauss)
    energy += ng.Variation(-share * force * u[2] * ng.ds(definedon=mesh.BBoundaries("right")))
    residual, step = solution.vec.CreateVector(), solution.vec.CreateVector()
    for k in range(10):
        share.Set((k + 1) / 10)
        for _ in range(40):
            take_mean()
            energy.Apply(solution.vec, residual)
            energy.AssembleLinearization(solution.vec)
            inverse = energy.mat.Inverse(space.FreeDofs(True), inverse="sparsecholesky")
            right = residual.CreateVector()
            right.data = residual
            right.data += energy.harmonic_extension_trans * residual
            step.data = inverse * right
            step.data += energy.harmonic_extension * step
            step.data += energy.inner_solve * residual
            solution.vec.data -= step
            if abs(ng.InnerProduct(step, residual)) < 1e-22:
                break
    return np.array([solution.components[0](mesh(*point, VOL_or_BND=ng.BND)) for point in points])
