"""Sends every example by the generated client, and reads what comes back as typed objects.

Usage: check.py URL EXAMPLES; the package `skyduct_client` is beside the working folder.
"""

import datetime
import json
import pathlib
import sys

import yaml
from ruamel.yaml import YAML
from skyduct_client import Client, models
from skyduct_client.api.jobs import create_job, get_job, list_jobs, plan_job
from skyduct_client.api.meshes import create_mesh
from skyduct_client.api.models import create_model
from skyduct_client.api.results import compute_annual_hours, get_annual, get_convergence, get_grid_csv, get_grid_json, get_tube_json
from skyduct_client.api.weather import create_weather
from skyduct_client.types import File

EVENTS = {
    "queued": models.QueuedEvent,
    "planned": models.PlannedEvent,
    "started": models.StartedEvent,
    "pass": models.PassReport,  # PassEvent is no more than this, and the generator leaves it out
    "image": models.ImageEvent,
    "phase": models.PhaseEvent,
    "succeeded": models.SucceededEvent,
    "failed": models.FailedEvent,
    "cancelled": models.CancelledEvent,
}


def events(client, job):
    """The events of a job until its end, each as the object of its component."""
    with client.get_httpx_client().stream("GET", job.links.events, timeout=120) as stream:
        fields = {}
        for line in stream.iter_lines():
            if line:
                name, _, value = line.partition(":")
                fields[name] = value.removeprefix(" ")
            elif "data" in fields:
                yield fields["event"], EVENTS[fields["event"]].from_dict(json.loads(fields["data"]))
                fields = {}
            else:
                fields = {}


def upload(client, path, create):
    """An uploaded mesh or weather file."""
    with open(path, "rb") as file:
        answer = create.sync_detailed(client=client, body=File(payload=file, file_name=path.name))
    assert answer.status_code == 201, answer
    return answer.parsed


def cheap(document):
    """The example with a cheap end; everything else is sent as it is."""
    document.stop.max_passes = 2
    document.stop.max_seconds = 20.0
    for view in document.views or []:
        view.size_px = [32, 24]
    return document


def check(client, path):
    written = json.loads(path.read_text())
    document = models.JobDocument.from_dict(written)
    assert document.to_dict() == written, f"{path}: the client changes the document"
    if not document.stop:
        document.stop = models.StopDocument()
    for tube in document.tubes or []:
        assert isinstance(tube, (models.ParametricTube, models.MeshTubeDocument)), tube
        if isinstance(tube, models.MeshTubeDocument):
            mesh = upload(client, path.parent / tube.mesh, create_mesh)
            assert mesh.triangles > 0
            tube.mesh = mesh.id
            assert all(not isinstance(part, dict) for part in tube.parts.additional_properties.values())
        else:
            assert type(tube.diffuser).__name__.endswith("Diffuser"), tube.diffuser
    if isinstance(document.room.hbjson, str):
        model = upload(client, path.parent / document.room.hbjson, create_model)
        assert model.report.rooms[0].faces > 4
        document.room.hbjson = model.id
    if document.annual:
        weather = upload(client, path.parent / document.annual.weather, create_weather)
        assert weather.report.records > 0
        document.annual.weather = weather.id
    document = cheap(document)
    plan = plan_job.sync(client=client, body=document)
    assert isinstance(plan, models.PlanResource), plan
    answer = create_job.sync_detailed(client=client, body=document, idempotency_key=path.name)
    assert answer.status_code == 202, answer.content
    assert answer.headers["location"] == answer.parsed.links.self_
    names = [name for name, event in events(client, answer.parsed)]
    assert names[:3] == ["queued", "planned", "started"] and names[-1] == "succeeded", names
    job = get_job.sync(client=client, id=answer.parsed.id)
    assert job.status == models.JobStatus.SUCCEEDED and job.timing.passes >= 1, job
    for grid in document.grids or []:
        result = get_grid_json.sync(client=client, id=job.id, name=grid.name)
        assert isinstance(result, models.GridResult), result
        assert len(result.illuminance_lux) == result.cells[1] and len(result.illuminance_lux[0]) == result.cells[0]
        assert bool(grid.points_m) == (not result.x_m), result
        assert result.statistics.max_lux >= result.statistics.mean_lux > 0
        assert "," in get_grid_csv.sync(client=client, id=job.id, name=grid.name)
    for index, _ in enumerate(document.tubes or []):
        report = get_tube_json.sync(client=client, id=job.id, tube=f"{index}")
        assert isinstance(report, models.TubeReport), report
    if document.annual:
        year = get_annual.sync(client=client, id=job.id)
        assert isinstance(year, models.AnnualResult) and year.grids[0].verdicts, year
        hour = models.HourDocument(time=datetime.datetime.fromisoformat("2026-06-21T12:00:00+02:00"), direct_normal_irradiance_w_m2=700.0, diffuse_horizontal_irradiance_w_m2=130.0)
        array = compute_annual_hours.sync(client=client, id=job.id, grid=document.grids[0].name, body=models.HourListDocument([hour]))
        assert isinstance(array, File), array
        assert array.payload.read().startswith(b"\x93NUMPY"), array
    assert isinstance(get_convergence.sync(client=client, id=job.id), models.Convergence)
    print(f"  {path.name}: {', '.join(dict.fromkeys(names))}")


def description(path):
    """Readers of YAML 1.1 (PyYAML) read what those of 1.2 do, all of it JSON."""
    text = pathlib.Path(path).read_text()
    read = yaml.safe_load(text)
    json.dumps(read)
    assert read == YAML(typ="safe", pure=True).load(text), "versions of YAML disagree"


def main(url, examples):
    description("openapi.yaml")
    client = Client(base_url=url, raise_on_unexpected_status=True, timeout=120)
    paths = sorted(pathlib.Path(examples).glob("*.json"))
    assert len(paths) >= 9, paths
    for path in paths:
        check(client, path)
    assert len(list_jobs.sync(client=client).jobs) == len(paths)
    # the sky types are not read: the generator's own variable `d` hides the parameter of that name
    bad = models.JobDocument.from_dict(json.loads((pathlib.Path(examples) / "thesis_room.json").read_text()))
    bad.grids[0].height_m = 1e3
    problem = create_job.sync(client=client, body=bad)
    assert isinstance(problem, models.Problem) and problem.errors[0].pointer == "/grids/0/height_m", problem


main(*sys.argv[1:])
