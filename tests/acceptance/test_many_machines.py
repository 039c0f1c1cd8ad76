"""Many machines on one run folder: what docs/command_line.md shows is run, on loopback."""

from __future__ import annotations

import json
import os
import shlex
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest
import yaml

from slide_fmu.data import cluster as data_cluster
from tests.acceptance.conftest import invoke
from tests.folder_digest import folder_digest
from tests.limits import HANGS
from tests.own_models.lag_beside import write_lag

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "docs" / "many_machines"
COMPOSE = yaml.safe_load((EXAMPLES / "compose.yml").read_text(encoding="utf-8"))["services"]
TOTAL = 5 + 3


@dataclass(frozen=True)
class Machine:
    """A machine on which commands of the examples run: here, in another folder."""

    folder: Path

    @property
    def environment(self) -> dict[str, str]:
        """Where the console scripts are found, and this package, but nothing beside a recipe."""
        path = os.pathsep.join([str(self.folder / "bin"), os.environ["PATH"]])
        return {**os.environ, "PATH": path, "PYTHONPATH": str(ROOT)}

    def install(self, name: str, text: str) -> None:
        """Install a program, of a shell's text."""
        program = self.folder / "bin" / name
        program.parent.mkdir(parents=True, exist_ok=True)
        program.write_text(f"#!/bin/bash\n{text}\n", encoding="utf-8")
        program.chmod(0o755)

    @contextmanager
    def running(self, command: list[str]) -> Iterator[None]:
        """Run a command, and what it starts, during the block."""
        process = subprocess.Popen(
            command,
            cwd=self.folder,
            env=self.environment,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        try:
            yield
        finally:
            os.killpg(process.pid, signal.SIGTERM)
            process.wait(HANGS)

    def run(self, *command: str | Path, code: int = 0, **variables: str) -> str:
        """Run a command to its end, which is to have a code, and return what it says."""
        result = subprocess.run(
            [str(word) for word in command],
            cwd=self.folder,
            env={**self.environment, **variables},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=HANGS,
        )
        assert result.returncode == code, result.stdout
        return result.stdout


@pytest.fixture
def machine(tmp_path: Path) -> Machine:
    prepared = Machine(tmp_path / "machine")
    python = shlex.quote(sys.executable)
    prepared.install("slide-fmu", f'exec {python} -m slide_fmu "$@"')
    prepared.install("dask", f'exec {python} -m dask "$@"')
    prepared.install("python", f'exec {python} "$@"')
    return prepared


def generated(recipe: Path, runs: Path) -> int:
    """How many trajectories of a recipe one process makes that knows nothing of other tests."""
    command = [sys.executable, "-m", "slide_fmu", "generate", str(recipe), "--runs", str(runs)]
    options = ["--workers", "1", "--json", "-"]
    result = subprocess.run([*command, *options], cwd=ROOT, check=True, capture_output=True)
    return int(json.loads(result.stdout)["made_now"])


@pytest.fixture(scope="module")
def digest(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The digest of the trajectories of the recipe, made by one process of this machine."""
    folder = tmp_path_factory.mktemp("alone")
    assert generated(write_lag(folder / "recipe"), folder) == TOTAL
    return folder_digest(folder / "lag" / "trajectories")


def free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


@pytest.mark.extended
def test_scheduler_and_workers_of_the_composition_make_the_same_trajectories(
    tmp_path: Path, machine: Machine, digest: str
) -> None:
    """They find the model beside its recipe, and notice that it is another one than they know."""
    port = free_port()

    def command(service: str) -> list[str]:
        text = COMPOSE[service]["command"].replace("scheduler:8786", f"127.0.0.1:{port}")
        text = text.replace("--port 8786", f"--host 127.0.0.1 --port {port}")
        return shlex.split(
            text.replace("/shared/$RECIPE", "recipe/lag.toml").replace("/shared/", "")
        )

    write_lag(tmp_path / "recipe")
    with ExitStack() as processes:
        processes.enter_context(machine.running(command("scheduler")))
        for _ in range(COMPOSE["worker"]["deploy"]["replicas"]):
            processes.enter_context(machine.running(command("worker")))
        user = Machine(tmp_path)
        words = [str(machine.folder / "bin" / "slide-fmu"), *command("generate")[1:]]
        user.run(*words)
        trajectories = tmp_path / "runs" / "lag" / "trajectories"
        assert folder_digest(trajectories) == digest
        write_lag(tmp_path / "recipe", rate=3.0)
        said = user.run(*words, code=1)
        assert "restart the workers" in " ".join(said.split())


@pytest.mark.extended
def test_tasks_of_the_job_array_make_the_trajectories_together(
    tmp_path: Path, machine: Machine, digest: str
) -> None:
    recipe, runs = write_lag(tmp_path / "recipe"), tmp_path / "runs"
    for _ in range(2):
        machine.run("bash", EXAMPLES / "array.sh", recipe, runs, SLURM_CPUS_PER_TASK="1")
    assert generated(recipe, runs) == 0
    assert folder_digest(runs / "lag" / "trajectories") == digest


SBATCH = """
job=$(mktemp "{folder}/job.XXXXXX")
cp "$1" "$job"  # who submits it removes it at once
(setsid bash "$job" >"$job.log" 2>&1 & echo $! >>"{folder}/jobs")
echo "Submitted batch job $(wc -l <"{folder}/jobs")"
"""
SCANCEL = 'kill -- -$(sed -n "$1p" "{folder}/jobs")'


@pytest.mark.extended
def test_jobs_that_slurm_starts_make_the_same_trajectories(
    tmp_path: Path, machine: Machine, digest: str
) -> None:
    """A program ``sbatch`` starts the jobs here that dask-jobqueue writes."""
    recipe, runs = write_lag(tmp_path / "recipe"), tmp_path / "runs"
    machine.install("sbatch", SBATCH.format(folder=machine.folder))
    machine.install("scancel", SCANCEL.format(folder=machine.folder))
    machine.run("python", EXAMPLES / "slurm.py", recipe, runs, "1")
    assert len((machine.folder / "jobs").read_text().split()) == 1
    assert folder_digest(runs / "lag" / "trajectories") == digest


def test_array_and_composition_name_what_there_is() -> None:
    assert (ROOT / COMPOSE["worker"]["build"]["dockerfile"]).is_file()
    assert {"scheduler", "worker", "generate"} == set(COMPOSE)
    assert any("--executor" in file.read_text() for file in EXAMPLES.iterdir())


@pytest.mark.extended
def test_scheduler_that_is_not_there_ends_the_command_with_a_message(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(data_cluster, "CONNECT", 1.0)
    recipe = write_lag(tmp_path)
    result = invoke("generate", recipe, "--runs", tmp_path, "--executor", "dask://127.0.0.1:9")
    assert result.exit_code == 1
    assert "does not answer within" in " ".join(result.stderr.split())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--executor", "localhost:8786"), "expected dask://HOST:PORT"),
        (("--executor", "dask://a:1", "--workers", "2"), "leave --workers out"),
    ],
)
def test_options_that_do_not_fit_are_refused(
    tmp_path: Path, options: tuple[str, ...], message: str
) -> None:
    result = invoke("generate", write_lag(tmp_path), "--runs", tmp_path, *options)
    assert result.exit_code == 1
    assert message in " ".join(result.stderr.split())
