"""What contributors meet first: the guides, the forms, the hooks, the citation and the public workflow."""

import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
WORKFLOW = ROOT / ".github" / "workflows" / "ci.yml"
GUIDES = ["CONTRIBUTING.md", "SECURITY.md", ".github/PULL_REQUEST_TEMPLATE.md"]


def text(name):
    return (ROOT / name).read_text(encoding="utf-8")


def workflow():
    return yaml.safe_load(WORKFLOW.read_text(encoding="utf-8"))


def targets():
    return set(re.findall(r"^([a-z-]+):", text("Makefile"), re.MULTILINE))


def asked_of_make(source):
    return set(re.findall(r"(?:`|run: |scripts/bare |^    )make ([a-z-]+)", source, re.MULTILINE))


@pytest.mark.parametrize("guide", [*GUIDES, ".github/workflows/ci.yml"])
def test_make_has_every_target_that_is_named(guide):
    assert asked_of_make(text(guide)) - targets() == set()


@pytest.mark.parametrize("guide", GUIDES)
def test_links_lead_to_files(guide):
    links = {link for link in re.findall(r"\]\(([^)#]+)", text(guide)) if "://" not in link}
    assert {link for link in links if not (ROOT / link).exists()} == set()


def test_the_workflow_runs_the_pythons_that_the_package_names():
    project = tomllib.loads(text("pyproject.toml"))["project"]
    named = [line.rpartition(" ")[2] for line in project["classifiers"] if re.search(r":: 3\.\d+$", line)]
    assert workflow()["jobs"]["test"]["strategy"]["matrix"]["python"] == named
    assert project["requires-python"] == f">={named[0]}"


def test_the_workflow_may_only_read_and_ends_in_time():
    found = workflow()
    assert found["permissions"] == {"contents": "read"}
    assert found["concurrency"]["group"]
    for name, job in found["jobs"].items():
        assert job["timeout-minutes"] <= 60, name
        assert "permissions" not in job, name


@pytest.mark.skipif(not shutil.which("actionlint"), reason="actionlint is not installed; a pre-commit hook runs it")
def test_actionlint_finds_no_fault():
    done = subprocess.run(
        ["actionlint", *WORKFLOW.parent.glob("*.yml")], cwd=ROOT, capture_output=True, text=True, timeout=250
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_hooks_format_as_make_lint_does():
    hooks = yaml.safe_load(text(".pre-commit-config.yaml"))["repos"]
    (ruff,) = (hook["rev"] for hook in hooks if hook["repo"].endswith("/ruff-pre-commit"))
    assert f"ruff=={ruff.removeprefix('v')}" in text("pip-constraints.txt").splitlines()


@pytest.mark.slow
def test_the_listed_host_tests_need_no_unix_and_no_gateware():
    command = [sys.executable, "-m", "pytest", "-p", "host_only", "--collect-only", "-q", "@tests/host.txt"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=250)
    assert done.returncode == 0, done.stdout + done.stderr
    files = {line.partition("::")[0] for line in done.stdout.splitlines() if "::" in line}
    assert files == set(text("tests/host.txt").split())
