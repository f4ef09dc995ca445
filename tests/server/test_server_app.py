"""The interface over HTTP: what each route answers, to whom, and what it refuses."""

from __future__ import annotations

import io
import json
import os
import threading
import time
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import spem

pytest.importorskip("lancedb")
pytest.importorskip("fastapi")

import httpx
import uvicorn

from spem.codes.collection import encode_file
from spem.index.index import Index
from spem.server import services as services_module
from spem.server.app import create_app
from spem.server.arrays import MEDIA_TYPE, unpack_arrays
from spem.server.options import ServerOptions
from spem.server.routes_files import FILES
from spem.server.running import listen
from spem.server.tasks import TASKS
from spem.server.views.downloads import DOWNLOADS

TOKEN = "0123456789abcdef0123"  # noqa: S105
WRITING = {"Authorization": f"Bearer {TOKEN}"}
ABSENT = "0" * 20


class InlineSandbox:
    """Runs tasks in this process, in a folder of its own."""

    n_workers = 1

    def __init__(self, *_):
        self.closed = False

    def run(self, task, header, payload=b"", **_):
        """Run a task."""
        return TASKS[task](dict(header), payload)

    def ready(self):
        """Tell whether it is open."""
        return not self.closed

    def stats(self):
        """Return some figures."""
        return {"workers": 1}

    def close(self):
        """Close it."""
        self.closed = True


def disk(radius: float) -> spem.Shape:
    return spem.synthetic.disk(radius=radius, spacing=1.0)


def picture(width: int = 20) -> bytes:
    image = np.zeros((40, 50), np.uint8)
    image[10:30, 10 : 10 + width] = 255
    content = io.BytesIO()
    Image.fromarray(image).save(content, "PNG")
    return content.getvalue()


@pytest.fixture(scope="module")
def index(tmp_path_factory) -> Index:
    made = Index.open(tmp_path_factory.mktemp("server") / "shapes.db")
    shapes = [disk(6.0), disk(7.0), spem.synthetic.star_polygon(5, 2)]
    made.add(shapes, features="spem", voxels=None, n_centers=8)
    made.annotate(where="name = 'disk'", label="it's round", metadata={"site": "Oslo"})
    return made


@pytest.fixture(scope="module")
def client(index, tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SPEM_MEMORY_LIMIT", os.environ.get("SPEM_MEMORY_LIMIT", ""))
        patch.chdir(tmp_path_factory.mktemp("work"))
        patch.setattr(services_module, "Sandbox", InlineSandbox)
        options = ServerOptions(token=TOKEN, upload_bytes=100_000, rate=0)
        app = create_app(index, options)
        with served(app) as opened:
            opened.services = app.state.services
            yield opened


@pytest.fixture(scope="module")
def ids(client) -> list[str]:
    return [entry["id"] for entry in client.get("/api/shapes").json()["shapes"]]


@contextmanager
def served(app, lifespan="on"):
    opened = listen(ServerOptions(port=0))
    server = uvicorn.Server(
        uvicorn.Config(app, log_config=None, lifespan=lifespan, ws="none", server_header=False)
    )
    thread = threading.Thread(target=server.run, kwargs={"sockets": [opened]})
    thread.start()
    try:
        with httpx.Client(base_url=f"http://127.0.0.1:{opened.getsockname()[1]}", timeout=60) as client:
            while not server.started:
                time.sleep(0.01)
            yield client
    finally:
        server.should_exit = True
        thread.join()
        opened.close()


def finished(client, answer) -> dict:
    assert answer.status_code == 202, answer.text
    for _ in range(400):
        job = client.get(f"/api/jobs/{answer.json()['job']}").json()
        if job["state"] not in ("queued", "running"):
            return job
        time.sleep(0.02)
    pytest.fail("the job does not come to an end")


def test_health_and_readiness(client):
    """A server that runs says that it lives and is ready."""
    assert client.get("/health").json() == {"status": "ok"}
    assert client.get("/ready").json() == {"status": "ready"}


def test_readiness_needs_a_start(index):
    """Before it has started a server lives, but is not ready."""
    with served(create_app(index), lifespan="off") as app:
        assert app.get("/health").status_code == 200
        assert app.get("/ready").status_code == 503


def test_info_tells_models_and_limits(client, index):
    """What is served is told without the folder it lies in."""
    told = client.get("/api/info").json()
    assert told["index"] == Path(index.store.address).name
    assert told["models"][0]["n_shapes"] == 3
    assert told["model"] == told["models"][0]["digest"]
    assert told["labels"] == [{"label": "it's round", "n": 2}]
    assert told["limits"]["upload_bytes"] == 100_000
    assert told["writable"] is True


@pytest.mark.parametrize(
    ("query", "total"),
    [
        ("", 3),
        ("q=DISK", 2),
        ("q='", 0),
        ("q=%25", 0),
        ("label=it's round", 2),
        ("ndim=2", 3),
        ("ndim=3", 0),
        ("metadata=site:Oslo", 2),
        ("metadata=site:Oslo&q=star", 0),
        ("metadata=si'te:x", None),
    ],
)
def test_filters_are_literal(client, query, total):
    """Filters hold together, and what would be SQL in them is text."""
    answer = client.get(f"/api/shapes?{query}")
    assert answer.status_code == (200 if total is not None else 422)
    assert answer.json().get("total") == total


def test_pages_follow_each_other(client):
    """Pages of one order make up the list, each shape once."""
    first = client.get("/api/shapes?limit=2&sort=volume").json()
    second = client.get("/api/shapes?limit=2&offset=2&sort=volume").json()
    volumes = [entry["volume"] for entry in first["shapes"] + second["shapes"]]
    assert first["total"] == 3
    assert len(volumes) == 3
    assert volumes == sorted(volumes, reverse=True)


def test_one_shape_has_its_report_and_no_path(client, ids):
    """A shape comes with its report and its model."""
    told = client.get(f"/api/shapes/{ids[0]}").json()
    assert told["report"]["components"] == 1
    assert "/" not in told["report"]["source"]


def test_thumbnail_is_kept_by_its_tag(client, ids):
    """A picture that the browser has is not sent again."""
    path = f"/api/shapes/{ids[0]}/thumbnail.png"
    first = client.get(path)
    assert first.headers["content-type"] == "image/png"
    again = client.get(path, headers={"If-None-Match": first.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")


def test_neighbours_agree_with_the_index(client, ids, index):
    """Search over HTTP answers as the index does, the shape itself first."""
    told = client.get(f"/api/shapes/{ids[0]}/neighbours?k=3").json()
    expected = index.search(ids[0], 3)
    assert [entry["shape"]["id"] for entry in told["answers"]] == [one.row.id for one in expected]
    assert told["answers"][0]["shape"]["id"] == ids[0] == told["query"]["id"]
    distances = [entry["distance"] for entry in told["answers"]]
    assert distances == pytest.approx([one.distance for one in expected], abs=1e-5)


def test_neighbours_of_a_label(client, ids):
    """A filter on the label keeps others out."""
    told = client.get(f"/api/shapes/{ids[0]}/neighbours", params={"label": "it's round"}).json()
    assert {entry["shape"]["label"] for entry in told["answers"]} == {"it's round"}


def test_views_are_arrays_and_kept(client, ids, index):
    """Geometry and field have one row a node, and are computed once."""
    geometry = client.get(f"/api/shapes/{ids[0]}/geometry")
    assert geometry.headers["content-type"] == MEDIA_TYPE
    header, arrays = unpack_arrays(geometry.content)
    assert (header["id"], len(arrays["node"])) == (ids[0], index.get(ids[0]).n_nodes)
    _, field = unpack_arrays(client.get(f"/api/shapes/{ids[0]}/field").content)
    assert len(field["basis"]) == len(arrays["node"])
    kept = client.services.kept.n_bytes
    assert client.get(f"/api/shapes/{ids[0]}/geometry").content == geometry.content
    assert client.services.kept.n_bytes == kept


def test_files_of_a_shape(client, ids):
    """The files that can be kept are those that views make, under a name of the shape."""
    assert set(FILES) == set(DOWNLOADS)
    answer = client.get(f"/api/shapes/{ids[0]}/field.npz")
    assert "disk-field.npz" in answer.headers["content-disposition"]
    with np.load(io.BytesIO(answer.content), allow_pickle=False) as file:
        assert file["fields"].shape[1] == 64
    assert client.get(f"/api/shapes/{ids[0]}/passwd").status_code == 404
    assert client.get(f"/api/shapes/{ids[0]}/source/100000").status_code == 422


def test_map_has_each_shape(client, ids):
    """The map of the collection has a place for each shape."""
    told = client.get("/api/map").json()
    assert {point["id"] for point in told["points"]} == set(ids)
    assert told["total"] == 3


def test_search_by_a_file(client):
    """A file is searched for as a shape, which can be looked at afterwards."""
    job = finished(
        client, client.post("/api/search", files={"file": ("../../hand.png", picture())}, data={"k": "2"})
    )
    assert job["state"] == "done", job["error"]
    result = job["result"]
    assert result["query"]["id"] == f"upload-{job['id']}"
    assert result["query"]["file"] == "hand.png"
    assert len(result["answers"]) == 2
    upload = f"/api/shapes/{result['query']['id']}"
    assert client.get(upload).json()["n_nodes"] == 400
    assert client.get(f"{upload}/thumbnail.png").status_code == 200
    again = client.get(f"{upload}/neighbours?k=2").json()
    assert again["answers"] == result["answers"]


def test_encode_gives_the_code_of_the_model(client, index, tmp_path):
    """The code of an upload is that which the model makes of the file."""
    (tmp_path / "hand.png").write_bytes(picture(24))
    job = finished(client, client.post("/api/encode", files={"file": ("hand.png", picture(24))}))
    expected = encode_file(tmp_path / "hand.png", index.model())
    assert np.allclose(job["result"]["code"], expected, atol=1e-6)


def test_files_of_one_name_are_two_shapes(client, index):
    """Two uploads of one name do not push each other out, and stand for no file of the host."""
    made = []
    for width in (26, 30):
        answer = client.post("/api/shapes", files={"file": ("same.png", picture(width))}, headers=WRITING)
        made.append(finished(client, answer)["result"]["shape"])
    assert made[0]["id"] != made[1]["id"]
    assert {shape["file"] for shape in made} == {"same.png"}
    assert all(index.get(shape["id"]).path.startswith("upload:") for shape in made)
    for shape in made:
        assert client.delete(f"/api/shapes/{shape['id']}", headers=WRITING).json() == {"removed": 1}


def test_add_and_remove_with_the_token(client):
    """A shape is added with its label and metadata, found, and removed again."""
    form = {"name": "plate", "label": "new", "metadata": json.dumps({"year": 2001})}
    answer = client.post("/api/shapes", files={"file": ("x.png", picture(28))}, data=form, headers=WRITING)
    shape = finished(client, answer)["result"]["shape"]
    assert (shape["name"], shape["label"], shape["metadata"]) == ("plate", "new", {"year": "2001"})
    assert client.get("/api/shapes?label=new").json()["total"] == 1
    path = f"/api/shapes/{shape['id']}"
    assert client.delete(path).status_code == 401
    assert client.delete(path, headers=WRITING).json() == {"removed": 1}
    assert client.get(path).status_code == 404
    assert client.get("/api/shapes?label=new").json()["total"] == 0


@pytest.mark.parametrize(
    "header", [{}, {"Authorization": "Bearer wrong"}, {"Authorization": "Bearer é".encode()}]
)
def test_writing_needs_the_token(client, header):
    """Without the right token nothing is written, and nothing is read of the body."""
    answer = client.post("/api/shapes", files={"file": ("x.png", picture())}, headers=header)
    assert answer.status_code == 401
    assert answer.headers["www-authenticate"] == "Bearer"


def test_reading_server_takes_nothing(index):
    """A server without a token refuses to write."""
    with served(create_app(index), lifespan="off") as app:
        assert app.delete(f"/api/shapes/{ABSENT}", headers=WRITING).status_code == 403


@pytest.mark.parametrize(
    ("files", "data", "status"),
    [
        ({"file": ("x.zip", b"PK")}, {}, 415),
        ({"file": ("x.png", b"")}, {}, 422),
        ({"other": ("x.png", b"1")}, {}, 422),
        ({"file": ("x.png", b"1")}, {"k": "1001"}, 422),
        ({"file": ("x.png", b"1")}, {"k": "-1"}, 422),
        ({"file": ("x.png", b"1")}, {"k": "9" * 400}, 422),
        ({"file": ("x.png", b"1")}, {"label": "a\nb"}, 422),
        ({"file": ("x.png", bytes(200_000))}, {}, 413),
        ([("file", ("x.png", b"1")), ("file", ("y.png", b"1"))], {}, 400),
        ({"file": ("x.png", b"1")}, {f"field{i}": "x" for i in range(9)}, 400),
        ({"file": ("x.png", b"1")}, {"label": "x" * 20_000}, 400),
    ],
)
def test_forms_are_checked(client, files, data, status):
    """Wrong forms are refused on one line before a job is made of them."""
    answer = client.post("/api/search", files=files, data=data)
    assert answer.status_code == status, answer.text
    assert "\n" not in answer.json()["error"]


def test_damaged_file_fails_its_job(client):
    """A file that cannot be read fails its job with a line that names it."""
    job = finished(client, client.post("/api/search", files={"file": ("bad.png", b"\x89PNG nonsense")}))
    assert job["state"] == "failed"
    assert job["error"].startswith("bad.png")


@pytest.mark.parametrize("charset", ["undefined", "punycode", "unicode_escape", "no-such", '"'])
def test_forms_are_in_utf_8(client, charset):
    """No codec is chosen by a client: some of them fail on any text."""
    body = b'--x\r\nContent-Disposition: form-data; name="file"; filename="a.png"\r\n\r\nx\r\n--x--\r\n'
    kind = f"multipart/form-data; boundary=x; charset={charset}"
    answer = client.post("/api/search", content=body, headers={"Content-Type": kind})
    assert answer.status_code == 415
    assert "UTF-8" in answer.json()["error"]


@pytest.mark.parametrize("told", [r'{"a": "\ud800"}', r'{"\u0000": "b"}', '{"": "b"}', r'{"a": "b\nc"}'])
def test_metadata_is_plain_text(client, told):
    """Metadata that cannot be stored, or shown on a line, is refused before there is a job."""
    form = {"files": {"file": ("a.png", b"x")}, "data": {"metadata": told}}
    answer = client.post("/api/shapes", headers=WRITING, **form)
    assert answer.status_code == 422
    assert "metadata" in answer.json()["error"]


@pytest.mark.parametrize(
    ("headers", "size", "status"),
    [(WRITING, 8 << 20, 413), ({}, 90_000, 401), ({"Origin": "http://evil"}, 8 << 20, 403)],
)
def test_refusals_reach_who_sends_much(client, headers, size, status):
    """Who sends much is told why it is refused, not cut off."""
    answer = client.post("/api/shapes", files={"file": ("x.png", bytes(size))}, headers=headers)
    assert answer.status_code == status


def test_bodies_are_counted_while_they_come(client):
    """A body of unknown length is cut off at the limit."""
    head = b'--x\r\nContent-Disposition: form-data; name="file"; filename="a.png"\r\n\r\n'
    answer = client.post(
        "/api/search",
        content=iter([head, *([bytes(65_536)] * 4)]),
        headers={"Content-Type": "multipart/form-data; boundary=x"},
    )
    assert answer.status_code == 413


@pytest.mark.parametrize(
    "headers",
    [{"Host": "evil.example"}, {"Host": "127.0.0.1.evil.example"}, {"Host": ""}, {"Host": "[::1"}],
)
def test_other_names_are_refused(client, headers):
    """A page that had its name rebound to this address reads nothing."""
    assert client.get("/api/info", headers=headers).status_code == 421


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
    ],
)
def test_other_sites_cannot_send(client, headers):
    """What a page of another site sends is refused, whatever it is."""
    answer = client.post("/api/search", files={"file": ("x.png", picture())}, headers=headers)
    assert answer.status_code == 403


def test_every_answer_has_the_headers_of_security(client):
    """Pages, data and errors alike say what browsers may do with them; nothing says which server it is."""
    for path in ("/", "/api/info", "/nothing", "/api/shapes?limit=-1"):
        headers = client.get(path).headers
        assert "frame-ancestors 'none'" in headers["content-security-policy"]
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["cross-origin-resource-policy"] == "same-origin"
        assert "access-control-allow-origin" not in headers
        assert "server" not in headers


def test_unforeseen_errors_tell_nothing(index, monkeypatch, caplog):
    """An error that nobody foresaw is told by a number; the log has the rest under it."""
    app = create_app(index)

    def broken(*_):
        msg = "secret /srv/place"
        raise RuntimeError(msg)

    monkeypatch.setattr(app.state.services.catalogue, "digest", broken)
    with served(app, lifespan="off") as client:
        answer = client.get("/api/shapes")
    assert answer.status_code == 500
    assert "secret" not in answer.text
    assert answer.headers["x-request-id"] in answer.json()["error"]
    [record] = [record for record in caplog.records if record.levelname == "ERROR"]
    assert record.fields["request"] == answer.headers["x-request-id"]


def test_rate_by_client(index):
    """Who asks too often is told when to come again; health is answered all the same."""
    with served(create_app(index, ServerOptions(rate=1.0)), lifespan="off") as app:
        statuses = [app.get("/api/nothing").status_code for _ in range(6)]
        assert statuses[:4] == [404] * 4
        last = app.get("/api/nothing")
        assert last.status_code == 429
        assert int(last.headers["retry-after"]) >= 1
        assert app.get("/health").status_code == 200


def test_metrics_count_by_route(client):
    """Figures name routes, never addresses, and have jobs and shapes."""
    client.get(f"/api/shapes/{ABSENT}")
    text = client.get("/metrics").text
    assert 'spem_requests_total{method="GET",route="/api/shapes/{id}",status="404"}' in text
    assert ABSENT not in text
    assert "spem_index_shapes 3.0" in text
    assert "spem_jobs_done" in text


def test_head_is_get_without_a_body(client):
    """HEAD answers as GET does, without the body."""
    answer = client.head("/api/info")
    assert (answer.status_code, answer.content) == (200, b"")


ODD = (
    "",
    "-1",
    "0",
    "1e99",
    "nan",
    "inf",
    "' OR 1=1 --",
    "../../etc/passwd",
    "%00",
    "é" * 300,
    "a" * 5000,
    "[]",
    "\ud7ff",
)


def test_odd_values_on_every_route(client):
    """No value of any parameter of any route brings the server down."""
    document = client.get("/openapi.json").json()
    tried = 0
    for path, methods in document["paths"].items():
        for method, about in methods.items():
            names = [entry["name"] for entry in about.get("parameters", ()) if entry["in"] == "query"]
            for value in ODD:
                address = path
                for name in [entry["name"] for entry in about.get("parameters", ()) if entry["in"] == "path"]:
                    address = address.replace(f"{{{name}}}", value.replace("/", "%2f") or "x")
                answer = client.request(
                    method, address.replace("%00", "%2500"), params=dict.fromkeys(names, value)
                )
                assert answer.status_code < 500, (method, address, value, answer.text)
                if answer.status_code >= 400:
                    assert set(answer.json()) == {"error"}
                tried += 1
    assert tried > 150


def test_shapes_are_found_without_the_name_of_their_model(tmp_path):
    """The first model is meant, however many shapes others get; an id leads to its shape in any of them."""
    made = Index.open(tmp_path / "shapes.db")
    made.add([disk(6.0)], features="spem", voxels=None, n_centers=4)
    flat = made.digest()
    balls = [spem.synthetic.ball(radius=radius, spacing=1.0) for radius in (4.0, 5.0)]
    solid = spem.encode(balls, features="spem", voxels=None, n_centers=4).model
    made.add(balls, model=solid)
    row, _ = made.rows(model=solid.digest)
    with served(create_app(made), lifespan="off") as client:
        address = f"/api/shapes/{row.id}"
        assert client.get("/api/info").json()["model"] == flat
        assert client.get(address).json()["model"] == solid.digest
        assert client.get(f"{address}/thumbnail.png").status_code == 200
        assert client.get(f"{address}/neighbours").json()["answers"][0]["shape"]["id"] == row.id
        assert client.get(address, params={"model": flat}).status_code == 404
        assert client.get(f"/api/shapes/{ABSENT}").status_code == 404
