"""Results that depend on a value directly and through positions: forces of springs, pressures, tensions.

Their gradients are compared with central differences.
"""

import numpy as np
import pytest

import magshell as ms

torch = pytest.importorskip("torch")

EXACT = ms.MixedNewton(tolerance=1e-12)
MESH = ms.meshes.rectangle(0.05, 0.01, cells=(5, 1))
SHEET = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.3, mass_density=1e3)
CLAMP = ms.Clamp(MESH.edges_at(x=0.0))
WEIGHT = (0, 0, -9.81)
STRING = ms.Spring(
    (SHEET, (0.05, 0.01, 0)), (0.05, 0.01, 0.05), stiffness=2.0, rest_length=0.02, damping=0.01
)
FROM_ABOVE = ms.Spring((SHEET, [(0.05, 0, 0), (0.04, 0, 0)]), (0.05, 0, 0.03), stiffness=(0.5, 0.4))
PAD = ms.Spring((SHEET, [(0.05, 0, 0), (0.04, 0, 0)]), stiffness=(0.5, 0.3))
BED = ms.ElasticFoundation(10.0)
TAUT = ms.Tendon(
    [(SHEET, (0.005, 0.005, 0)), (SHEET, (0.05, 0.005, 0))], tension=1e-3, stiffness=1.0, rest_length=0.03
)
SPRUNG = ms.Scene(SHEET, supports=[CLAMP], loads=[STRING, FROM_ABOVE, PAD], gravity=WEIGHT)
BEDDED = ms.Scene(SHEET, supports=[CLAMP], loads=[BED], gravity=WEIGHT)
STRUNG = ms.Scene(SHEET, supports=[CLAMP], actuators=[TAUT], gravity=WEIGHT)


def box_of(**fluid):
    """Build a box of a soft sheet, held at its floor and filled with a fluid; the scene and its cavity."""
    box = ms.meshes.box((0.1, 0.1, 0.1), cells=(2, 2, 1))
    sheet = ms.Shell(ms.TriangleMesh(box.rest_positions, box.faces), thickness=5e-3, young_modulus=1e6)
    cavity = ms.Cavity(sheet, **fluid)
    held = ms.Pin(sheet.mesh.vertices_at(z=0.0))
    return ms.Scene(sheet, supports=[held], actuators=[cavity]), cavity


def block_with(make):
    """Build a block held at one side, with one actuator and a force on its other side; the scene and the actuator."""
    mesh = ms.meshes.box((0.1, 0.1, 0.1), cells=(2, 1, 1))
    block = ms.Solid(mesh, material=ms.NeoHookean(young_modulus=1e3, poisson_ratio=0.2), element="linear")
    actuator, held = make(block), ms.Pin(mesh.vertices_at(x=0.0))
    pull = ms.PointLoad(mesh.vertices_at(x=0.1), (0.3, 0, 0.1))
    return ms.Scene(block, supports=[held], loads=[pull], actuators=[actuator]), actuator


FLUIDS = {
    "pressed": box_of(pressure=200.0),
    "gas": box_of(gas_pressure=1.02e5),
    "liquid": box_of(volume=1.02e-3, bulk_modulus=1e6),
}
CELLS = block_with(lambda block: ms.PneumaticCells(block, stiffness=1e4, volume_ratio=1.125))
LINES = block_with(
    lambda block: ms.Tendon(
        [(0, 0.03, 0.05), (0.04, 0.06, 0.05), (0.1, 0.05, 0.07)], block, stiffness=40.0, sliding=False
    )
)


def rows():
    """Return what is compared: a scene, an object with a derived result, its name, the owner of an input, and its name."""
    at_rest, factor = (SHEET, "rest_positions"), (None, "load_factor")
    found = []
    for spring in (STRING, FROM_ABOVE):
        inputs = [(spring, by) for by in ("stiffness", "rest_length", "ground") if by in spring._replaceable]
        found += [
            (SPRUNG, spring, name, *by)
            for name in ("tension", "length", "force")
            for by in (*inputs, at_rest)
        ]
    found += [(SPRUNG, PAD, "force", *by) for by in ((PAD, "stiffness"), (PAD, "ground"), at_rest)]
    found += [(SPRUNG, PAD, "ends", *by) for by in ((PAD, "ground"), at_rest)]
    found += [(BEDDED, BED, name, BED, "stiffness") for name in ("forces", "total_force")]
    inputs = [(TAUT, by) for by in ("tension", "stiffness", "rest_length")]
    found += [(STRUNG, TAUT, "tension", *by) for by in (*inputs, factor)]
    for scene, cavity in FLUIDS.values():
        inputs = [(cavity, by) for by in cavity._replaceable]
        at_rest = (scene.bodies[0], "rest_positions")
        found += [(scene, cavity, "pressure", *by) for by in (*inputs, factor, at_rest)]
    scene, cells = CELLS
    inputs = [(cells, "stiffness"), (cells, "volume_ratio"), factor, (scene.bodies[0], "rest_positions")]
    found += [(scene, cells, name, *by) for by in inputs for name in ("pressures", "volume_ratios")]
    scene, line = LINES
    inputs = [(line, "stiffness"), (line, "smoothing"), (scene.bodies[0], "rest_positions")]
    found += [(scene, line, "tension", *by) for by in inputs]
    # The pressure of a pressed cavity is what was given, whatever the rest positions.
    return [
        each
        for each in found
        if each[2:] != ("pressure", each[3], "rest_positions") or each[1].law != "pressure"
    ]


def value_of(scene, owner, name):
    """Return the value of an input; the load factor is 0.8."""
    return np.array(0.8 if owner is None else getattr(owner, name), dtype=np.float64)


def given(owner, name, value, scene=None):
    """Return the keywords of a solve in which one input has this value."""
    return {name: value} if owner is None else {"values": {owner: {name: value}}}


def compare(function, value, tolerance=1e-6):
    """Compare the gradient of a function along a direction with central differences, whose steps are chosen."""
    tensor = torch.tensor(value, requires_grad=True)
    found = function(tensor)
    weights = np.random.default_rng(1).standard_normal(found.shape)
    (torch.from_numpy(weights) * found).sum().backward()
    along = np.random.default_rng(2).uniform(0.5, 1.0, value.shape) * np.abs(value).max(initial=0.0)
    slope = float((tensor.grad.numpy() * along).sum())
    at = lambda step: float((weights * np.asarray(function(value + step * along))).sum())  # noqa: E731
    differences = [(at(step) - at(-step)) / (2 * step) for step in (1e-3, 1e-4, 1e-5)]
    size = np.linalg.norm(tensor.grad.numpy()) * np.linalg.norm(along)
    assert size > 0.0
    assert min(abs(each - slope) for each in differences) < tolerance * size, (slope, differences)


@pytest.mark.parametrize("row", rows(), ids=lambda row: f"{row[2]} of {type(row[1]).__name__} by {row[4]}")
def test_results_of_equilibria_have_the_slopes_of_differences(row):
    scene, owner, name, of, by = row
    compare(
        lambda value: getattr(ms.equilibrium(scene, solver=EXACT, **given(of, by, value))[owner], name),
        value_of(scene, of, by),
    )


@pytest.mark.parametrize("varies", [False, True])
@pytest.mark.parametrize("name", ["stiffness", "rest_length", "damping"])
def test_forces_of_springs_in_motion_have_the_slopes_of_differences(name, varies):
    value = np.array(getattr(STRING, name))
    if varies:
        value = value * np.linspace(1.0, 1.5, 6)
    compare(
        lambda each: (
            ms.simulate(
                SPRUNG, steps=5, time_step=2e-3, record_every=5, solver=EXACT, values={STRING: {name: each}}
            )[STRING].force
        ),
        value,
    )


@pytest.mark.parametrize("name", ["load_factor", "tension", "stiffness"])
def test_tensions_in_motion_have_the_slopes_of_differences(name):
    owner = None if name == "load_factor" else TAUT
    value = np.linspace(0.5, 1.0, 5) * (1.0 if owner is None else getattr(TAUT, name))
    compare(
        lambda each: (
            ms.simulate(STRUNG, steps=4, time_step=2e-3, solver=EXACT, **given(owner, name, each))[
                TAUT
            ].tension
        ),
        value,
    )


def test_results_of_load_cases_have_the_slopes_of_differences():
    scene, cavity = FLUIDS["gas"]
    compare(
        lambda value: ms.equilibrium(scene, load_factor=value, solver=EXACT)[cavity].pressure,
        np.array((0.7, 1.0)),
    )
    body = scene.bodies[0]
    compare(
        lambda value: (
            ms.equilibrium(
                scene, load_factor=(0.7, 1.0), values={body: {"rest_positions": value}}, solver=EXACT
            ).displacements
        ),
        body.rest_positions,
    )


def test_results_of_members_have_the_slopes_of_differences():
    both = np.array((2.0, 2.5))

    def tensions(value):
        batch = ms.equilibrium(SPRUNG, batch=2, solver=EXACT, values={STRING: {"stiffness": value}})
        found = [batch[k][STRING].tension for k in range(2)]
        return torch.stack(found) if isinstance(found[0], torch.Tensor) else np.array(found)

    def moving(value):
        batch = ms.simulate(
            SPRUNG, batch=2, steps=2, time_step=2e-3, solver=EXACT, values={STRING: {"stiffness": value}}
        )
        found = [batch[k][STRING].tension for k in range(2)]
        return torch.stack(found) if isinstance(found[0], torch.Tensor) else np.array(found)

    compare(tensions, both)
    compare(moving, both)


def test_values_in_time_of_a_batch_have_no_gradient_here():
    rows = torch.tensor([[2.0, 2.1, 2.2], [2.5, 2.6, 2.7]], dtype=torch.float64, requires_grad=True)
    batch = ms.simulate(SPRUNG, batch=2, steps=2, time_step=2e-3, values={STRING: {"stiffness": rows}})
    found = batch[0][STRING].tension
    stretch = batch[0].positions.detach()[:, -1] - torch.tensor(STRING.ground)
    assert found.shape == (3,) and (stretch.norm(dim=1) > 0).all()
    with pytest.raises(ms.NoGradient, match="stiffness"):
        found.sum().backward()


def tension(stiffness):
    """Return the tension of the string at rest."""
    return ms.equilibrium(SPRUNG, solver=EXACT, values={STRING: {"stiffness": stiffness}})[STRING].tension


def test_tangents_are_those_of_gradients():
    value, along = torch.tensor(2.0, dtype=torch.float64), torch.tensor(0.3, dtype=torch.float64)
    _, tangent = torch.func.jvp(tension, (value,), (along,))
    assert float(tangent) == pytest.approx(0.3 * float(torch.func.grad(tension)(value)), rel=1e-9)


def test_results_of_warm_starts_have_the_slopes_of_differences():
    warm = ms.WarmStart(SPRUNG, solver=EXACT)
    warm(values={STRING: {"stiffness": 1.9}})
    compare(lambda each: warm(values={STRING: {"stiffness": each}})[STRING].tension, np.array(2.0))


@pytest.mark.parametrize("integrator", [ms.ImplicitEuler(), ms.TRBDF2()], ids=repr)
@pytest.mark.parametrize("kind", [ms.Prismatic, ms.Screw])
def test_rates_of_joints_have_the_slopes_of_differences(kind, integrator):
    """Check a link that slides on a turning one: velocities are along its axis to the order of the integrator only."""
    arm = ms.Link(mass=1.0, center=(0.5, 0, 0), inertia=0.1)
    bob = ms.Link(mass=0.5, center=(1.2, 0.1, 0), inertia=0.05)
    own = {"pitch": 0.1} if kind is ms.Screw else {}
    hinge = ms.Revolute(arm, origin=(0, 0, 0), axis=(0.1, 1, 0.2), rate=3.0)
    slide = kind(bob, arm, origin=(1, 0, 0), axis=(1, 0.2, 0.1), spring_stiffness=50.0, rate=1.0, **own)
    scene = ms.Scene(ms.Skeleton([arm, bob], [hinge, slide]), gravity=(0, 1.0, -9.81))

    def rates(axis):
        values = {slide: {"axis": axis}}
        options = {"steps": 5, "time_step": 0.02, "integrator": integrator, "solver": EXACT}
        return ms.simulate(scene, values=values, **options)[slide].rate

    compare(rates, np.array((1.0, 0.2, 0.1)))
