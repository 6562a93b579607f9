"""The declared groups, free coordinates and their inverse, the model file and what it refuses."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm

from facade_tools.artifacts.attributes import Attributes
from facade_tools.artifacts.documents import decode, encode
from facade_tools.artifacts.numbers import canonical
from facade_tools.errors import InvalidInput
from facade_tools.exteriors.coordinates import read_attributes, write_attributes
from facade_tools.exteriors.dataset import build, fit_scaling
from facade_tools.exteriors.density import log_density
from facade_tools.exteriors.evaluation import negative_log_density
from facade_tools.exteriors.groups import GROUPS, Coordinate, Group, Reading, read_part, write_part
from facade_tools.exteriors.kernels import gaussian
from facade_tools.exteriors.layout import building_layout
from facade_tools.exteriors.learning import LearnOptions, learn_model
from facade_tools.exteriors.network import infer
from facade_tools.exteriors.prior import shipped_prior
from facade_tools.exteriors.samples import SampleOptions, sample_attributes
from facade_tools.exteriors.serialisation import groups_to_model, network_of
from facade_tools.exteriors.transforms import TRANSFORMS, forward, inverse

ALONE = """
import json, sys

class Block:
    def find_spec(self, name, path=None, target=None):
        top = name.split(".")[0]
        own = top in {"numpy", "scipy", "facade_tools"} or top.startswith("_")
        if not own and top not in sys.stdlib_module_names:
            raise ImportError(name)

sys.meta_path.insert(0, Block())
import numpy as np
from facade_tools.artifacts.codec import from_json
from facade_tools.artifacts.model import Model
from facade_tools.exteriors.samples import sample_attributes

model = from_json(Model, json.load(open(sys.argv[1])))
rows = sample_attributes(model, 4, rng=np.random.default_rng(7))
print(json.dumps([(*row.mass.bbox, *row.facade.wwr) for row in rows]))
"""


@pytest.fixture(scope="module")
def houses() -> list[Attributes]:
    return shipped_prior()


@pytest.fixture(scope="module")
def model(houses):
    options = LearnOptions(variant="no-lateral", largest=3)
    return learn_model(houses[::4], rng=np.random.default_rng(0), options=options)


def test_coordinates_and_back_give_the_same_attributes(houses):
    layout = building_layout()
    readings = read_attributes(houses, layout)
    heights = np.array([h.storey_height for h in houses])
    for before, after in zip(houses, write_attributes(readings, layout, heights), strict=True):
        for name in ("bbox", "bcr", "bdry", "far", "arf", "garage", "porch"):
            a, b = np.array(getattr(before.mass, name)), np.array(getattr(after.mass, name))
            assert a == pytest.approx(b, abs=2e-5), (before.id, name)
        assert before.facade == after.facade
        assert before.element == after.element


@pytest.mark.parametrize("name", TRANSFORMS)
def test_transform_inverts_and_its_slope_is_the_derivative(name):
    x = np.array([0.03, 0.4, 0.9]) + (1.0 if name == "log-above-1" else 0.0)
    t, slope = forward(name, x)
    assert inverse(name, t) == pytest.approx(x)
    step = 1e-6
    numeric = (forward(name, x + step)[0] - forward(name, x - step)[0]) / (2 * step)
    assert np.exp(slope) == pytest.approx(numeric, rel=1e-5)


def test_gaussian_kernel_equals_scipy_with_missing_coordinates():
    rng = np.random.default_rng(1)
    d, k, n, q = 3, 2, 40, 2
    root = rng.normal(size=(k, d, d))
    cov = root @ root.swapaxes(1, 2) + np.eye(d)
    coef = rng.normal(size=(k, d, 1 + q))
    x, z = rng.normal(size=(n, d)), rng.normal(size=(n, q))
    dense = rng.random((n, d)) < 0.6
    masks, index = np.unique(dense, axis=0, return_inverse=True)
    order = np.argsort(index.ravel(), kind="stable")
    starts = np.searchsorted(np.sort(index.ravel()), np.arange(len(masks) + 1))
    found = gaussian(x, z, order, starts, masks, coef, cov)
    for i in range(n):
        seen = np.flatnonzero(dense[i])
        for j in range(k):
            mean = coef[j] @ np.concatenate([[1.0], z[i]])
            expected = 0.0
            if len(seen):
                density = multivariate_normal(mean[seen], cov[j][np.ix_(seen, seen)])
                expected = density.logpdf(x[i, seen])
            assert found[i, j] == pytest.approx(expected, abs=1e-9)


def test_density_is_per_metre_with_atoms_as_mass(model, houses):
    """One observed number at a time: the mixture over its clusters, by scipy and by hand."""
    network = network_of(model)
    group = network.layout.groups[0]
    family, scaling = network.families[0], network.scalings[0]
    share = network.style @ family.hidden
    width = 11.3
    row = Attributes("w", mass=replace(houses[0].mass.__class__(), bbox=(width, None, None)))
    t = (np.log(width) - scaling.center[0]) / scaling.scale[0]
    spread = np.sqrt(family.cov[:, 0, 0])
    expected = share @ norm.pdf(t, family.coef[:, 0, 0], spread) / scaling.scale[0] / width
    assert group.name == "bbox"
    assert -negative_log_density(model, [row])[0] == pytest.approx(np.log(expected))
    atom = Attributes("b", mass=replace(houses[0].mass.__class__(), bcr=1.0))
    mass = (network.style @ network.families[1].hidden) @ network.families[1].tables[0][:, 1]
    assert -negative_log_density(model, [atom])[0] == pytest.approx(np.log(mass))


def test_density_integrates_to_one_over_a_coordinate_and_its_atom(model):
    network = network_of(model)
    grid = np.linspace(1e-4, 1 - 1e-4, 20001)
    mass = Attributes("x").mass
    rows = [Attributes(str(i), mass=replace(mass, bcr=float(b))) for i, b in enumerate(grid)]
    density = np.exp(log_density(network, read_attributes(rows, network.layout)))
    atom = np.exp(-negative_log_density(model, [Attributes("a", mass=replace(mass, bcr=1.0))])[0])
    assert np.trapezoid(density, grid) + atom == pytest.approx(1.0, abs=2e-3)


def test_posteriors_equal_enumeration(model, houses):
    network = network_of(model)
    readings = read_attributes(houses[:5], network.layout)
    data = build(readings, network.layout, network.scalings)
    found = infer(network, data)
    from facade_tools.exteriors.network import local_log_density

    local = [
        np.exp(local_log_density(f, g, data.features))
        for f, g in zip(network.families, data.groups, strict=True)
    ]
    for n in range(5):
        joint = network.style.copy()
        for s in range(len(joint)):
            for bit, p in zip(data.bits[n], network.bits[s], strict=True):
                joint[s] *= p if bit == 1 else 1 - p
            for family, table in zip(network.families, local, strict=True):
                joint[s] *= sum(family.hidden[s, k] * table[n, k] for k in range(table.shape[1]))
        assert found.log_density[n] == pytest.approx(np.log(joint.sum()))
        assert found.style[n] == pytest.approx(joint / joint.sum())


def test_a_row_with_nothing_observed_is_refused(model):
    with pytest.raises(InvalidInput, match="nothing is observed"):
        negative_log_density(model, [Attributes("empty")])


def test_model_survives_its_file(model, houses):
    document = canonical(encode(model))
    again = decode(json.loads(json.dumps(document)), "model")
    assert negative_log_density(again, houses) == pytest.approx(
        negative_log_density(model, houses), abs=1e-6
    )


def test_rounding_of_another_processor_is_not_written(model):
    network = network_of(model)
    rng = np.random.default_rng(5)
    first = network.families[0]
    size = first.cov.shape[1]
    root = rng.normal(0, 1, (len(first.cov), size, size)) * np.geomspace(0.05, 2, size)[:, None]
    cov = root @ root.transpose(0, 2, 1)
    cov[:, :2, 2:] = cov[:, 2:, :2] = 0
    written = []
    for noise in (0, 1e-17):
        other = rng.normal(0, noise, cov.shape)
        family = replace(first, cov=cov + other, coef=first.coef + rng.normal(0, noise))
        families = (family, *network.families[1:])
        group = groups_to_model(replace(network, families=families))[0]
        written.append(canonical([group.coefficients, group.covariances]))
    assert written[0] == written[1]


def _broken(model, change):
    document = json.loads(json.dumps(canonical(encode(model))))
    change(document)
    return decode(document, "model")


@pytest.mark.parametrize(
    ("change", "pointer"),
    [
        (lambda d: d["style"].__setitem__(0, 0.9999), "/style"),
        (lambda d: d["groups"][0]["hidden"][0].__setitem__(0, 0.5), "/groups/0/hidden/0"),
        (lambda d: d["groups"][0]["covariances"][0][0].__setitem__(0, -1.0), "/covariances/0"),
        (lambda d: d["groups"][0]["coefficients"].pop(), "/groups/0/coefficients"),
        (lambda d: d["groups"][0].update(inputs=["nobody"]), "/groups/0/inputs"),
        (lambda d: d["groups"].append(d["groups"][0]), "/groups"),
        (lambda d: d["groups"][0].update(direct=True), "/groups/0/hidden"),
        (
            lambda d: d["groups"][1]["channels"][0]["states"].append("?"),
            "/groups/1/channels/0/states",
        ),
        (lambda d: d["training"]["ids"].pop(), "/training/values"),
        (
            lambda d: d["groups"][0]["coordinates"][1].update(center=1e300),
            "/groups/0/coordinates/1/center",
        ),
        (
            lambda d: d["groups"][0]["coordinates"][0].update(scale=1e-300),
            "/groups/0/coordinates/0/scale",
        ),
    ],
)
def test_a_tampered_file_is_refused(model, change, pointer):
    with pytest.raises(InvalidInput) as error:
        network_of(_broken(model, change))
    assert pointer in error.value.place.pointer


def test_edges_in_a_cycle_are_refused(model):
    def cycle(document):
        for a, b in ((0, 1), (1, 0)):
            group = document["groups"][a]
            group["inputs"] = [document["groups"][b]["coordinates"][0]["name"]]
            group["coefficients"] = [
                [[*row, 0.1] for row in cluster] for cluster in group["coefficients"]
            ]

    with pytest.raises(InvalidInput, match="cycle"):
        network_of(_broken(model, cycle))


def test_one_declaration_adds_a_patio(houses):
    """A new part: its coordinates, how it is read, how it is written."""
    sizes = tuple(Coordinate(f"patio.{n}", "log", 0.05, (), 0.2, 100.0) for n in ("w", "d"))

    def read(a: Attributes) -> Reading:
        return read_part(a.tags.get("patio", (None, None)), None)

    def write(columns, values):
        columns["patio"] = write_part(values)

    patio = Group("patio", "mass", sizes, read, write, ("patio",))
    rng = np.random.default_rng(3)
    rows = [
        replace(h, tags={"patio": (0.0, 0.0) if rng.random() < 0.5 else (h.mass.bbox[0] / 3, 2.5)})
        for h in houses[::4]
    ]
    groups = (*GROUPS, patio)
    options = LearnOptions(groups=groups, largest=2, variant="no-lateral")
    learned = learn_model(rows, rng=rng, options=options)
    assert learned.cardinalities["patio"] == 2
    drawn = list(sample_attributes(learned, 60, rng=rng, options=SampleOptions(groups=groups)))
    there = [row.tags["patio"][1] for row in drawn if row.tags["patio"][0] > 0]
    assert 15 < len(there) < 45
    assert np.median(there) == pytest.approx(2.5, abs=0.3)


def test_scaling_of_a_constant_column_is_its_floor(houses):
    rows = [replace(h, mass=replace(h.mass, bbox=(10.0, 8.0, 3.0))) for h in houses[:20]]
    layout = building_layout()
    scaling = fit_scaling(read_attributes(rows, layout), layout)[0]
    assert scaling.scale == pytest.approx(0.05 / np.array([10.0, 8.0, 3.0]))


def test_a_model_loads_and_samples_with_numpy_and_scipy_alone(model, tmp_path):
    """Nothing else can be imported: the compiled loops run as plain Python, to the same rows."""
    path = tmp_path / "model.json"
    path.write_text(json.dumps(encode(model)))
    done = subprocess.run(
        [sys.executable, "-c", ALONE, str(path)], capture_output=True, text=True, check=True
    )
    drawn = np.array(json.loads(done.stdout))
    again = list(sample_attributes(model, 4, rng=np.random.default_rng(7)))
    expected = np.array([(*row.mass.bbox, *row.facade.wwr) for row in again])
    assert drawn == pytest.approx(expected, rel=1e-9)
