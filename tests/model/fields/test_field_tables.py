"""Fields from tables: gridded and scattered, with the units and the names that other programs give them."""

import numpy as np
import pytest

import magshell as ms

AXES = (np.linspace(-10, 10, 9), np.linspace(-8, 8, 7), np.linspace(0, 12, 6))  # mm
GRID = np.stack(np.meshgrid(*AXES, indexing="ij"), axis=-1).reshape(-1, 3)
MAGNET = ms.Dipoles([(0, 0, -0.03)], [(0, 0.2, 1.0)])
INSIDE = np.random.default_rng(1).uniform((-8e-3, -6e-3, 2e-3), (8e-3, 6e-3, 10e-3), (50, 3))


def rows(points, separator=", ", flux=1e3):
    """Return lines of a table of the magnet's field at points in mm, B in mT by default."""
    values = flux * MAGNET.flux_density(1e-3 * points)
    return [separator.join(f"{each:.12g}" for each in row) for row in np.hstack([points, values])]


def written(folder, *lines):
    path = folder / "field.csv"
    path.write_text("\n".join(lines))
    return path


def of_grid():
    origin, spacing = GRID[0] * 1e-3, [1e-3 * (axis[1] - axis[0]) for axis in AXES]
    return ms.SampledField(origin, spacing, MAGNET.flux_density(1e-3 * GRID).reshape(9, 7, 6, 3))


NAMED = "x [mm], y [mm], z [mm], Bx [mT], By [mT], Bz [mT]"
COMSOL = [
    "% Model:              magnet.mph",
    "% Version:            COMSOL 6.1.0.357",
    "% Dimension:          3",
    "% Nodes:              378",
    "% Expressions:        3",
    "% Description:        Magnetic flux density, x-component, y-component, z-component",
    "% Length unit:        mm",
]


@pytest.mark.parametrize("order", ["as it is", "shuffled"])
def test_a_named_csv(order, tmp_path):
    points = GRID if order == "as it is" else np.random.default_rng(0).permutation(GRID)
    field = ms.SampledField.from_table(written(tmp_path, NAMED, *rows(points)))
    np.testing.assert_allclose(field.flux_density(INSIDE), of_grid().flux_density(INSIDE), rtol=1e-9)
    assert field.counts == (9, 7, 6) and field.table_error is None


@pytest.mark.parametrize(
    "separator, names",
    [("   ", "x   y   z   mf.Bx (T)   mf.By (T)   mf.Bz (T)"), (",", "x,y,z,mf.Bx (T),mf.By (T),mf.Bz (T)")],
)
def test_an_export_of_comsol(separator, names, tmp_path):
    path = written(tmp_path, *COMSOL, f"% {names}", *rows(GRID, separator, flux=1.0))
    field = ms.SampledField.from_table(path)
    np.testing.assert_allclose(field.flux_density(INSIDE), of_grid().flux_density(INSIDE), rtol=1e-9)


def test_semicolons_and_decimal_commas(tmp_path):
    lines = [line.replace(".", ",") for line in rows(GRID, ";")]
    field = ms.SampledField.from_table(written(tmp_path, NAMED.replace(",", ";"), *lines))
    np.testing.assert_allclose(field.flux_density(INSIDE), of_grid().flux_density(INSIDE), rtol=1e-9)


def test_no_names_and_columns_in_another_order(tmp_path):
    units = {"length_unit": "mm", "flux_density_unit": "mT"}
    plain = ms.SampledField.from_table(written(tmp_path, *rows(GRID, " ")), **units)
    np.testing.assert_allclose(plain.flux_density(INSIDE), of_grid().flux_density(INSIDE), rtol=1e-9)
    swapped = rows(GRID)
    path = written(tmp_path, "u, v, w, normB, B1, B2, B3", *(f"{a}" for a in _with_norm(swapped)))
    for columns in (("u", "v", "w", "B1", "B2", "B3"), (0, 1, 2, 4, 5, 6)):
        field = ms.SampledField.from_table(path, columns=columns, **units)
        np.testing.assert_allclose(field.flux_density(INSIDE), plain.flux_density(INSIDE), rtol=1e-9)


def _with_norm(lines):
    for line in lines:
        parts = line.split(", ")
        yield ", ".join([*parts[:3], "7", *parts[3:]])


def test_scattered_points_are_resampled_on_a_grid(tmp_path):
    points = np.random.default_rng(2).uniform((-10, -8, 0), (10, 8, 12), (3000, 3))
    path = written(tmp_path, NAMED, *rows(points))
    corners = {"lower": (-9e-3, -7e-3, 1e-3), "upper": (9e-3, 7e-3, 11e-3)}
    field = ms.SampledField.from_table(path, counts=(15, 13, 11), **corners)
    exact = MAGNET.flux_density(INSIDE)
    size = np.linalg.norm(exact, axis=1).mean()
    off = np.linalg.norm(field.flux_density(INSIDE) - exact, axis=1)
    assert off.max() < 2e-3 * size and 0.0 < field.table_error < 5e-3 * size
    with pytest.raises(ValueError, match=r"its points are no regular grid: give counts"):
        ms.SampledField.from_table(path)
    with pytest.raises(ValueError, match=r"lies outside the points of the table: give `lower` and `upper`"):
        ms.SampledField.from_table(path, counts=(15, 13, 11), lower=(-20e-3, 0, 0))


def test_table_of_a_plane_has_one_sample_across(tmp_path):
    flat = GRID[GRID[:, 1] == 0.0]
    field = ms.SampledField.from_table(written(tmp_path, NAMED, *rows(flat)))
    assert field.counts == (9, 1, 6)


def test_sheet_bends_in_a_field_from_a_table(tmp_path):
    field = ms.SampledField.from_table(written(tmp_path, NAMED, *rows(GRID)))
    mesh = ms.meshes.rectangle(8e-3, 4e-3, cells=(8, 4)).transformed(translation=(-4e-3, -2e-3, 4e-3))
    sheet = ms.Shell(mesh, thickness=2e-4, young_modulus=1e6)
    shapes = [
        ms.equilibrium(
            ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=-4e-3))], field=each),
            remanent_magnetization=(5e4, 0, 0),
        ).displacements
        for each in (field, MAGNET)
    ]
    assert np.abs(shapes[1]).max() > 1e-4
    np.testing.assert_allclose(shapes[0], shapes[1], atol=1e-2 * np.abs(shapes[1]).max())


BARE = "x, y, z, Bx, By, Bz"
BAD = {
    "no units": ([BARE], {}, r"does not say its units: give length_unit, one of m, cm, mm, um"),
    "no flux unit": ([BARE], {"length_unit": "mm"}, r"does not say its units: give flux_density_unit"),
    "another unit": ([NAMED], {"length_unit": "cm"}, r"length_unit is 'cm', but 'field.csv' says 'mm'"),
    "unknown unit": (
        [NAMED],
        {"length_unit": "inch"},
        r"length_unit must be one of m, cm, mm, um, got 'inch'",
    ),
    "unknown column unit": ([NAMED.replace("mT", "Wb")], {}, r"a column in 'Wb', which is none of T, mT"),
    "names": ([NAMED.replace("Bx", "Hx")], {}, r"but not exactly one is Bx: say by columns"),
    "columns": ([NAMED], {"columns": ("x",)}, r"columns must name six columns"),
    "column": ([NAMED], {"columns": ("x", "y", "z", "Bx", "By", "B")}, r"has no column 'B', only x, y, z"),
    "counts": ([NAMED], {"counts": (2, 2)}, r"counts must be three integers"),
    "corner": ([NAMED], {"lower": (0, 0, 0)}, r"lower and upper are of a grid to be made: give counts"),
}


@pytest.mark.parametrize("head, options, message", BAD.values(), ids=BAD)
def test_tables_with_bad_heads_are_refused(head, options, message, tmp_path):
    with pytest.raises(ValueError, match=message):
        ms.SampledField.from_table(written(tmp_path, *head, *rows(GRID)), **options)


LINES = {
    "not a number": ("1, 2, 3, 4, 5, six", r"line 380: '1, 2, 3, 4, 5, six' is not a row of numbers"),
    "short": ("1, 2, 3", r"line 380: 3 numbers, and 6 in the rows above"),
    "nan": ("1, 2, 3, nan, 0, 0", r"line 380: .* is not finite; leave such points out"),
}


@pytest.mark.parametrize("line, message", LINES.values(), ids=LINES)
def test_tables_with_bad_rows_are_refused(line, message, tmp_path):
    with pytest.raises(ValueError, match=message):
        ms.SampledField.from_table(written(tmp_path, NAMED, *rows(GRID), line))


def test_files_without_a_table_are_refused(tmp_path):
    with pytest.raises(ValueError, match="holds no rows of numbers"):
        ms.SampledField.from_table(written(tmp_path, "hello"))
    with pytest.raises(FileNotFoundError):
        ms.SampledField.from_table(tmp_path / "nothing.csv")
