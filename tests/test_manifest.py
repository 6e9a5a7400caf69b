import json
import shutil
import subprocess
import time

import numpy as np
import pytest

from softvox_gym import engine, manifest

needs_git = pytest.mark.skipif(shutil.which("git") is None, reason="needs git")


def git(folder, *arguments):
    identity = ("-c", "user.name=x", "-c", "user.email=x@y.z", "-c", "commit.gpgsign=false")
    command = ["git", *identity, *arguments]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
    return done.stdout.strip()


@needs_git
def test_the_commit_is_that_of_the_checkout_and_says_whether_it_was_changed(tmp_path, monkeypatch):
    source = tmp_path / "module.py"
    source.write_text("1\n")
    monkeypatch.setattr(manifest, "SOURCE", source)
    git(tmp_path, "init", "--quiet")
    assert manifest.commit() is None  # an installed copy inside a repository of something else
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "--quiet", "-m", "first")
    head = git(tmp_path, "rev-parse", "HEAD")
    assert manifest.commit() == head
    source.write_text("2\n")
    assert manifest.commit() == f"{head}-dirty"


def test_without_git_there_is_no_commit_and_no_error(monkeypatch):
    monkeypatch.setenv("PATH", "")
    assert manifest.commit() is None
    assert manifest.cpu_model() != ""


def test_the_provenance_is_ready_for_json_and_names_what_runs():
    origin = manifest.provenance(threads=3)
    assert json.loads(json.dumps(origin)) == origin
    assert (origin["threads"], origin["instruction_set"]) == (3, engine.isa_name())
    assert manifest.provenance()["threads"] == engine.default_threads()


def test_the_digest_depends_on_bits_and_not_on_layout_or_byte_order():
    values = np.arange(6.0).reshape(2, 3)
    digest = manifest.digest(values)
    assert manifest.digest(np.asfortranarray(values)) == digest
    assert manifest.digest(values.astype(">f8")) == digest
    assert manifest.digest(values + 1e-15) != digest
    assert manifest.digest(-0.0 * values) != manifest.digest(0.0 * values)


def test_the_probe_of_the_engine_is_the_same_every_time_and_sees_other_bits(monkeypatch):
    probe = manifest.engine_probe.__wrapped__
    assert probe() == manifest.engine_probe()
    assert len(probe()) == 64
    original = manifest.evaluate

    def nudged(*arguments, **options):
        found = original(*arguments, **options)
        if options["perturbations"]:
            found.displacement.view(np.uint64)[3, 0, 1] ^= 1
        return found

    monkeypatch.setattr(manifest, "evaluate", nudged)
    assert probe() != manifest.engine_probe()


def test_the_probe_takes_a_fraction_of_a_second():
    before = time.process_time()
    manifest.engine_probe.__wrapped__()
    # Measured 0.14; other work on the machine does not count.
    assert time.process_time() - before < 1
