"""`facade view`: pictures without a display, pages without a network."""

from __future__ import annotations

import base64
import json
import re
import shutil
import subprocess

import cv2
import numpy as np
import pytest
from test_export import FOOTPRINT, HOUSE, stream

from facade_tools.formats.gltf import write as write_glb
from facade_tools.formats.meshes import read_scene
from facade_tools.formats.png import write as write_png
from facade_tools.geometry.detail_boxes import box_triangles
from facade_tools.geometry.mesh import Material, Mesh, Scene
from facade_tools.imaging.camera import View, directions, fitted
from facade_tools.imaging.contact_sheet import contact_sheet
from facade_tools.imaging.page import Exhibit, page
from facade_tools.imaging.raster import NONE_CUT, rasterise
from facade_tools.imaging.render import Look, render
from facade_tools.imaging.surfaces import soup_of, to_linear, to_srgb

SMALL = View(azimuth=0.0, elevation=20.0, size=(96, 72))
ATTRIBUTES = {
    "schema": "facade-tools/attributes/1",
    "id": "a1",
    "mass": {"bbox": [10, 8, 3], "bcr": 1, "bdry": 4, "far": 1, "arf": [1, 0, 0],
             "garage": [0, 0, 0, 0, 0, 0], "porch": [[0] * 6, [None] * 6]},
    "facade": {"wwr": [0.2, 0.1, None, 0], "sym": [1, 1, 1, 1], "align": [1, 1, 1, None]},
    "element": {"roof": {"flat": 0, "gable": 1, "hip": None},
                "window": dict.fromkeys(("sash", "sliding", "casement", "bay", "fixed"), 0),
                "special": {"chimney": 1, "tower": 0}},
}  # fmt: skip


def block(color="#c03020", **look):
    vertices, faces = box_triangles([(0.0, 0.0, 0.0, 4.0, 3.0, 2.0)])
    return Scene(
        "block", (Mesh("mass", vertices, faces, "m"),), {"m": Material("m", color, **look)}
    )


# --- rasteriser and camera ------------------------------------------------------------------------


def brute_force(corners, shape):
    """The plain version of the kernel, a pixel at a time."""
    depth, owner = np.zeros(shape), np.full(shape, -1)
    for j in range(shape[0]):
        for i in range(shape[1]):
            for t, ((ax, ay, az), (bx, by, bz), (cx, cy, cz)) in enumerate(corners):
                m = np.array([[ax, bx, cx], [ay, by, cy], [1, 1, 1]])
                if abs(np.linalg.det(m)) < 1e-12:
                    continue
                w = np.linalg.solve(m, (i + 0.5, j + 0.5, 1))
                if w.min() >= 0 and w @ (az, bz, cz) > depth[j, i]:
                    depth[j, i], owner[j, i] = w @ (az, bz, cz), t
    return depth, owner


def test_rasteriser_agrees_with_brute_force():
    rng = np.random.default_rng(5)
    corners = rng.uniform(-4, 20, (12, 3, 3))
    corners[..., 2] = rng.uniform(0.1, 1.0, (12, 3))
    corners[0, 1] = corners[0, 0]  # degenerate
    depth, owner = np.zeros((14, 17)), np.full((14, 17), -1, dtype=np.int64)
    rasterise(corners, depth, owner, NONE_CUT)
    want_depth, want_owner = brute_force(corners, (14, 17))
    assert np.array_equal(owner, want_owner)
    assert np.allclose(depth, want_depth)


def turn(p, q):
    return p[0] * q[1] - p[1] * q[0]


def test_triangles_that_share_an_edge_leave_no_gap():
    rng = np.random.default_rng(1)
    for _ in range(50):
        a, b, c, d = rng.uniform(2, 18, (4, 2))
        if turn(b - a, c - a) * turn(b - a, d - a) >= 0:
            continue
        corners = np.ones((2, 3, 3))
        corners[0, :, :2], corners[1, :, :2] = (a, b, c), (b, a, d)
        owner = np.full((20, 20), -1, dtype=np.int64)
        rasterise(corners, np.zeros((20, 20)), owner, NONE_CUT)
        hull = cv2.convexHull(np.array([a, b, c, d], np.float32))
        along = a + np.linspace(0.1, 0.9, 30)[:, None] * (b - a)
        for x, y in along:
            if cv2.pointPolygonTest(hull, (float(x), float(y)), True) > 1.0:
                assert owner[int(y), int(x)] >= 0


@pytest.mark.parametrize("azimuth", [-30.0, 0.0, 90.0, 200.0])
@pytest.mark.parametrize("elevation", [0.0, 30.0, 85.0])
def test_camera_holds_all_points_and_fills_the_picture(azimuth, elevation):
    points = np.random.default_rng(0).uniform(-5, 9, (40, 3))
    view = View(azimuth, elevation, (200, 100))
    camera = fitted(points, view)
    assert np.allclose(camera.axes @ camera.axes.T, np.eye(3))
    seen = camera.project(points)
    assert seen[:, 2].min() > 0
    x, y = seen[:, 0] / 200, seen[:, 1] / 100
    assert min(x.min(), y.min()) >= 0.029
    assert max(x.max(), y.max()) <= 0.971
    assert max(np.ptp(x), np.ptp(y)) >= 0.93


def test_azimuth_turns_from_the_front_to_the_right_side():
    assert np.allclose(directions(0.0, 0.0)[2], (0, 1, 0))
    assert np.allclose(directions(90.0, 0.0)[2], (-1, 0, 0))


def test_color_spaces_are_inverse():
    values = np.linspace(0, 1, 50)
    assert np.allclose(to_srgb(to_linear(values)), values)


# --- pictures -------------------------------------------------------------------------------------


def test_picture_shows_the_block_in_its_color_and_is_deterministic():
    picture = render(block(), SMALL)
    assert picture.shape == (72, 96, 3)
    assert picture.dtype == np.uint8
    middle = picture[36, 48].astype(int)
    assert middle[0] > middle[1] + 40
    assert np.array_equal(picture, render(block(), SMALL))


def test_compiled_shading_agrees_with_its_plain_version():
    from facade_tools.imaging import shading

    kernels = {k: v for k, v in vars(shading).items() if hasattr(v, "py_func")}
    view, look = View(30.0, 25.0, (14, 10)), Look(samples=1, rays=4)
    want = render(block(pattern="brick"), view, look)
    patch = pytest.MonkeyPatch()
    with patch.context() as plain:
        for name, kernel in kernels.items():
            plain.setattr(shading, name, kernel.py_func)
        plain.setattr("facade_tools.imaging.render.shade", kernels["shade"].py_func)
        assert np.abs(render(block(pattern="brick"), view, look).astype(int) - want).max() <= 1


def test_the_side_away_from_the_sun_is_darker_and_the_ground_in_shadow_too():
    look = Look(sun=(90.0, 35.0), edges=0.0, rays=0)
    front = render(block("#ffffff"), View(-45.0, 15.0, (96, 72)), look)
    lit = front[40, 60:80].mean()
    dark = front[40, 20:40].mean()
    assert abs(lit - dark) > 20


def test_texture_is_drawn_where_its_uv_say():
    picture = np.zeros((2, 2, 3), np.uint8)
    picture[0] = (0, 255, 0)  # upper half green, lower half black
    vertices = np.array([(0.0, 0, 0), (4, 0, 0), (4, 0, 4), (0, 0, 4)])
    uv = np.array([(0.0, 0), (1, 0), (1, 1), (0, 1)])
    wall = Mesh("w", vertices, np.array([[0, 1, 2], [0, 2, 3]]), "t", uv)
    scene = Scene("s", (wall,), {"t": Material("t", "#ffffff", texture=write_png(picture))})
    seen = render(scene, View(0.0, 0.0, (60, 60)), Look(edges=0.0)).astype(int)
    assert seen[15, 30, 1] > seen[15, 30, 0] + 60
    assert seen[45, 30].max() < 40


def leaf_picture(opacity):
    picture = np.full((64, 64, 4), (0, 255, 0, 255), np.uint8)
    picture[16:48, 16:48] = (0, 0, 0, opacity)
    return picture


def leafy(opacity):
    """Return a red wall, and a metre before it a green one with a square hole."""
    corners = np.array([(0.0, 0, 0), (4, 0, 0), (4, 0, 4), (0, 0, 4)])
    uv, faces = corners[:, [0, 2]] / 4, np.array([[0, 1, 2], [0, 2, 3]])
    before = Mesh("before", corners, faces, "leaf", uv)
    behind = Mesh("behind", corners + np.array([0, 1, 0]), faces, "red")
    leaf = Material("leaf", "#ffffff", texture=write_png(leaf_picture(opacity)), cutout=True)
    return Scene("s", (before, behind), {"leaf": leaf, "red": Material("red", "#ff0000")})


@pytest.mark.parametrize(("opacity", "seen"), [(0, 0), (127, 0), (255, None)])
def test_holes_of_a_texture_are_seen_through_and_let_the_sun_in(opacity, seen):
    scene = leafy(opacity)
    picture = render(scene, View(0.0, 0.0, (96, 96)), Look(edges=0.0, sun=(0.0, 1.0), rays=0))
    middle, rim = picture[48, 48].astype(int), picture[12, 48].astype(int)
    assert rim[1] > rim[0] + 60
    if seen is None:
        assert middle.max() < 40
        return
    assert middle[seen] > middle[1] + 60
    behind = render(scene, View(0.0, 0.0, (96, 96)), Look(edges=0.0, sun=(90.0, 30.0), rays=0))
    assert middle[0] > behind[48, 48].astype(int)[0] + 30  # the sun comes in through the hole


def test_holes_survive_a_texture_that_is_scaled_down():
    picture = np.full((2048, 2048, 4), 255, np.uint8)
    picture[:, 1024:] = 0
    look = Material("leaf", "#ffffff", texture=write_png(picture), cutout=True)
    vertices = np.array([(0.0, 0, 0), (4, 0, 0), (4, 0, 4), (0, 0, 4)])
    uv = np.array([(0.0, 0), (1, 0), (1, 1), (0, 1)])
    wall = Mesh("w", vertices, np.array([[0, 1, 2], [0, 2, 3]]), "leaf", uv)
    soup = soup_of(Scene("s", (wall,), {"leaf": look}))
    first, height, width = soup.pictures[0]
    texels = soup.texels[first:].reshape(height, width, 4)
    assert (texels[:, : width // 2, :] == 255).all()
    assert (texels[:, width // 2 :, 3] == 0).all()


def test_holes_of_a_texture_go_into_the_page_as_a_mask():
    data = write_glb([leafy(0)], "m")
    document = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
    modes = {row["name"]: row.get("alphaMode") for row in document["materials"]}
    assert modes == {"leaf": "MASK", "red": None}


def test_holes_of_a_mesh_file_s_texture_are_kept(tmp_path):
    cv2.imwrite(str(tmp_path / "leaf.png"), leaf_picture(0))
    (tmp_path / "m.mtl").write_text("newmtl leaf\nmap_Kd leaf.png\n")
    corners = "v 0 0 0\nv 4 0 0\nv 4 4 0\nvt 0 0\nvt 1 0\nvt 1 1\n"
    (tmp_path / "m.obj").write_text(f"mtllib m.mtl\n{corners}usemtl leaf\nf 1/1 2/2 3/3\n")
    scene = read_scene(tmp_path / "m.obj")
    (mesh,) = scene.meshes
    look = scene.materials[mesh.material]
    stored = cv2.imdecode(np.frombuffer(look.texture, np.uint8), cv2.IMREAD_UNCHANGED)
    assert look.cutout
    assert (stored[32, 32, 3], stored[2, 2, 3]) == (0, 255)


def test_an_empty_scene_is_sky_and_ground():
    assert render(Scene("void", ()), SMALL).std() > 0


def test_a_picture_that_is_too_large_is_refused():
    with pytest.raises(ValueError, match="too large"):
        render(block(), View(size=(9000, 9000)))


def test_contact_sheet_has_a_cell_a_picture():
    pictures = [np.full((20, 30, 3), 10 * k, np.uint8) for k in range(5)]
    sheet = contact_sheet(pictures, [f"item {k}" for k in range(5)], columns=2)
    assert sheet.shape[1] == 2 * 36 + 6
    assert all((sheet == 10 * k).all(axis=2).sum() >= 600 for k in range(1, 5))
    assert contact_sheet([]).size


# --- the command ----------------------------------------------------------------------------------


def decoded(path):
    picture = cv2.imread(str(path))
    assert picture is not None
    return picture


def test_one_picture_a_sheet_and_four_sides(facade_here, tmp_path):
    options = ("--size", "80x60")
    for name, items, extra, columns in (
        ("one", [HOUSE], [], None),
        ("many", [HOUSE, FOOTPRINT, ATTRIBUTES], ["--no-labels"], None),
        ("sides", [HOUSE], ["--sides"], 4),
    ):
        out = tmp_path / f"{name}.png"
        done = facade_here("view", "-", "-o", out, *options, *extra, stdin=stream(*items))
        assert done.returncode == 0, done.stderr
        picture = decoded(out)
        assert picture.std() > 10
        assert columns is None or picture.shape[1] == columns * 86 + 6
    assert decoded(tmp_path / "one.png").shape == (60, 80, 3)


def test_a_mesh_file_is_drawn(facade_here, tmp_path):
    facade_here("export", "-", "-o", tmp_path / "m.glb", stdin=stream(HOUSE))
    done = facade_here("view", tmp_path / "m.glb", "-o", tmp_path / "m.png", "--size", "80x60")
    assert done.returncode == 0, done.stderr
    assert decoded(tmp_path / "m.png").std() > 10


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["-o", "x.gif"], 2),
        ([], 2),
        (["-o", "x.png", "--size", "big"], 2),
        (["-o", "x.png", "--size", "9999x9999"], 2),
    ],
)
def test_wrong_usage(facade_here, tmp_path, arguments, code):
    done = facade_here("view", "-", *arguments, stdin=stream(HOUSE), cwd=tmp_path)
    assert done.returncode == code
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["sheet.png", "page.html"])
def test_skip_draws_the_good_ones(facade_here, tmp_path, name):
    items = stream({**HOUSE, "id": "bad", "boxes": []}, FOOTPRINT)
    out = tmp_path / name
    words = ("view", "-", "-o", out, "--on-error", "skip")
    done = facade_here(*words, stdin=items)
    assert (done.returncode, out.exists()) == (3, True)
    assert b"1 bad items were skipped" in done.stderr


# --- pages ----------------------------------------------------------------------------------------


def test_page_holds_everything_and_asks_for_nothing():
    exhibits = [Exhibit("</script><b>@THREE@", "picture", b"PNG"), Exhibit("b", "model", b"glTF")]
    text = page(exhibits, "a & <b>").decode()
    assert text == page(exhibits, "a & <b>").decode()
    assert "<title>a &amp; &lt;b&gt;</title>" in text
    rows = json.loads(re.search(r'id="exhibits">(.*?)</script>', text, re.S)[1])
    assert rows[0]["name"] == "</script><b>@THREE@"
    assert base64.b64decode(rows[1]["data"]) == b"glTF"
    assert not re.search(r'(?:src|href)="(?!data:)', text)
    assert text.count("The MIT License") == 1


@pytest.fixture(scope="session")
def chromium():
    found = (
        shutil.which("chromium")
        or shutil.which("chromium-browser")
        or shutil.which("google-chrome")
    )
    if found is None:
        pytest.skip("no Chromium here")
    return found


def test_page_turns_in_a_browser_without_errors(facade_here, chromium, tmp_path):
    out = tmp_path / "page.html"
    assert facade_here("view", "-", "-o", out, stdin=stream(HOUSE, ATTRIBUTES)).returncode == 0
    # The page reports its own errors and what its canvas holds, for the dump of its document.
    watch = """<script>
      window.onerror = (message) => { document.documentElement.dataset.error = message; };
      window.onunhandledrejection = (event) => window.onerror(String(event.reason));
      for (const kind of ['error', 'warn'])
        console[kind] = (...words) => window.onerror(words.join(' '));
    </script>"""
    look = """<script>
      // Virtual time runs ahead of the decoding of textures: asking often gives it real time.
      const look = () => {
        if (!document.body.dataset.shown) { setTimeout(look, 5); return; }
        const source = document.getElementById('canvas');
        const copy = document.createElement('canvas');
        copy.width = 80; copy.height = 60;
        const pen = copy.getContext('2d');
        pen.drawImage(source, 0, 0, 80, 60);
        const seen = new Set();
        const data = pen.getImageData(0, 0, 80, 60).data;
        for (let i = 0; i < data.length; i += 4)
          seen.add(data[i] << 16 | data[i + 1] << 8 | data[i + 2]);
        document.documentElement.dataset.colors = seen.size;
      };
      look();
    </script>"""
    text = out.read_text().replace("<head>", f"<head>{watch}").replace("</body>", f"{look}</body>")
    out.write_text(text)
    command = [
        chromium, "--headless=new", "--no-sandbox", "--disable-gpu", "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader", f"--user-data-dir={tmp_path / 'profile'}",
        "--window-size=640,480", "--virtual-time-budget=300000", "--dump-dom", out.as_uri(),
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, timeout=120)
    head = re.search(r"<html[^>]*>", done.stdout.decode())
    assert head is not None
    assert "data-error" not in head[0], head[0]
    colors = re.search(r'data-colors="(\d+)"', head[0])
    assert colors is not None, head[0]
    assert int(colors[1]) > 50
    assert 'data-shown="h1"' in done.stdout.decode()
