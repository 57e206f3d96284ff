"""What publishes a release: the workflow, and what `make release-check` builds from the last commit."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import release
import yaml

ROOT = Path(__file__).resolve().parents[2]
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))


@pytest.mark.parametrize("file", WORKFLOWS, ids=lambda file: file.stem)
def test_actions_are_pinned_by_commit(file):
    used = re.findall(r"uses: (.+)$", file.read_text(encoding="utf-8"), re.MULTILINE)
    assert used
    assert [use for use in used if not re.fullmatch(r"[\w./-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+", use)] == []


def test_nothing_is_published_before_it_was_built_and_tried():
    jobs = yaml.safe_load((ROOT / ".github" / "workflows" / "release.yml").read_text())["jobs"]
    allowed = {name for name, job in jobs.items() if "write" in job.get("permissions", {}).values()}
    assert allowed == {"publish", "attach", "pages"}
    assert jobs["publish"]["needs"] == "try"
    assert jobs["publish"]["if"] == "github.ref_type == 'tag'"
    assert jobs["try"]["needs"] == "build"
    assert jobs["attach"]["needs"] == jobs["pages"]["needs"] == "publish"


def test_the_readmes_commands_run_with_the_oldest_and_the_newest_python_it_names():
    jobs = yaml.safe_load((ROOT / ".github" / "workflows" / "ci.yml").read_text())["jobs"]
    named = re.search(r"Python (3\.\d+) to (3\.\d+)", (ROOT / "README.md").read_text()).groups()
    assert sorted(one["python"] for one in jobs["bare"]["strategy"]["matrix"]["include"]) == list(named)


@pytest.fixture
def clone(tmp_path, monkeypatch):
    """A clone with one commit, of which a release is made."""
    folder = tmp_path / "clone"
    folder.mkdir()
    (folder / "committed").write_text("as committed\n")
    git = ["git", "-c", "user.name=x", "-c", "user.email=x@example.org"]
    for words in (["init", "-q"], ["add", "-A"], ["commit", "-qm", "first"]):
        subprocess.run([*git, *words], cwd=folder, check=True)
    monkeypatch.setattr(release, "ROOT", folder)
    monkeypatch.setattr(release, "RELEASE", tmp_path / "release")
    return folder


@pytest.mark.skipif(not shutil.which("git"), reason="git is not installed")
def test_a_release_holds_what_was_committed(clone, tmp_path):
    (clone / "committed").write_text("as worked on\n")
    (clone / "forgotten").write_text("never added\n")
    tree = release.exported(tmp_path / "tree")
    assert {file.name: file.read_text() for file in tree.iterdir()} == {"committed": "as committed\n"}


@pytest.fixture
def builds(tmp_path, monkeypatch):
    """Stands for place and route; takes the texts of the bitstreams of its builds, in order."""
    monkeypatch.setattr(release, "RELEASE", tmp_path)
    monkeypatch.setattr(release, "run", lambda program, tree: "starter")
    (tmp_path / "tree" / "examples" / "kits" / "starter").mkdir(parents=True)

    def builds(*texts):
        left = iter(texts)

        def build(tree, kit, folder):
            folder.mkdir(parents=True)
            (folder / "contactfpga.bin").write_text(next(left))
            return folder / "contactfpga.bin"

        monkeypatch.setattr(release, "build", build)

    return builds


def test_a_bitstream_goes_into_the_wheel_and_beside_it(builds, tmp_path):
    builds("bits", "bits")
    release.bitstreams(tmp_path / "tree", tmp_path / "kits")
    assert (tmp_path / "tree" / "examples" / "kits" / "starter" / "contactfpga.bin").read_text() == "bits"
    assert (tmp_path / "kits" / "contactfpga-starter.bin").read_text() == "bits"


def test_two_builds_that_differ_end_a_release(builds, tmp_path):
    builds("bits", "other bits")
    with pytest.raises(SystemExit, match="two builds of the kit starter gave two bitstreams"):
        release.bitstreams(tmp_path / "tree", tmp_path / "kits")


@pytest.mark.campaign
@pytest.mark.timeout(3600)
def test_everything_is_built_and_used_without_a_compiler():
    for words in (["make"], ["try", str(release.RELEASE / "dist"), "--offline"]):
        subprocess.run([sys.executable, str(ROOT / "scripts" / "release.py"), *words], check=True)
