"""Files that are complete at any moment, whoever else writes them."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from functools import partial

import pytest

from gym_mapbench.files.replacing import create_at_once, remove_abandoned, replaced_at_once

WRITE_FOR_EVER = """
import sys
from pathlib import Path
from gym_mapbench.files.replacing import replaced_at_once
with replaced_at_once(Path(sys.argv[1])) as file:
    print("half", flush=True)
    sys.stdin.read()
"""


def test_a_file_is_replaced_in_one_step(tmp_path):
    file = tmp_path / "a"
    file.write_bytes(b"before")
    with replaced_at_once(file) as target:
        target.write(b"after")
        target.flush()
        assert file.read_bytes() == b"before"
    assert file.read_bytes() == b"after"
    assert list(tmp_path.iterdir()) == [file]


def test_an_error_leaves_it_as_it_was_and_nothing_beside_it(tmp_path):
    file = tmp_path / "a"
    file.write_bytes(b"before")
    with pytest.raises(TypeError), replaced_at_once(file) as target:
        target.writelines([b"aft", None])
    assert file.read_bytes() == b"before"
    assert list(tmp_path.iterdir()) == [file]


@contextmanager
def writing(file):
    """Another process that writes a file and does not come to the end; at the end of the block it is killed."""
    command = [sys.executable, "-c", WRITE_FOR_EVER, file]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout.readline() == b"half\n"
        yield
        process.kill()


def remove_later(folder):
    """Do what a process that continues the folder an hour later does."""
    for file in folder.rglob(".*"):
        os.utime(file, (0, time.time() - 3600))
    remove_abandoned(folder)


@pytest.mark.skipif(os.name != "posix", reason="locks of POSIX")
def test_what_a_killed_process_left_is_removed_and_nothing_else(tmp_path):
    names = (".gitignore", ".a.csv.swp", "a.0123abcd.part", ".backup.20261128", ".config.settings.part")
    others = {tmp_path / name for name in names}
    for file in others:
        file.touch()
    figures = tmp_path / "figures"
    figures.mkdir()
    with writing(figures / "a.png"):
        remove_later(tmp_path)
        assert len([*figures.iterdir()]) == 1
    remove_abandoned(tmp_path)
    assert {*tmp_path.iterdir()} == {*others, figures}
    assert not [*figures.iterdir()]


def test_a_link_is_replaced_and_its_target_stays(tmp_path):
    target, link = tmp_path / "target", tmp_path / "link"
    target.write_bytes(b"mine")
    link.symlink_to(target)
    with replaced_at_once(link) as file:
        file.write(b"other")
    assert target.read_bytes() == b"mine"
    assert link.read_bytes() == b"other"
    assert not link.is_symlink()


def test_several_writers_do_not_disturb_each_other(tmp_path):
    """With one name for the unfinished file, they would write into and rename each other's."""
    file, errors, seen = tmp_path / "a", [], set()

    def write(letter):
        try:
            for _ in range(50):
                with replaced_at_once(file) as target:
                    for _ in range(10):
                        target.write(letter * 1000)
                seen.add(bytes(set(file.read_bytes())))
                assert file.stat().st_size == 10_000
        except BaseException as error:  # a thread's error would be lost
            errors.append(error)

    threads = [threading.Thread(target=write, args=(letter,)) for letter in (b"x", b"y", b"z")]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not errors
    assert seen <= {b"x", b"y", b"z"}


@pytest.mark.parametrize("links", [True, False])
def test_of_several_processes_one_creates_a_file(tmp_path, monkeypatch, links):
    def refuse(*_):
        raise OSError(errno.EPERM, "no hard links here")

    if not links:
        monkeypatch.setattr("os.link", refuse)
    file, won, lost, gate = tmp_path / "a", [], [], threading.Barrier(4)

    def create(letter):
        gate.wait()
        try:
            create_at_once(file, letter * 1000)
            won.append(letter)
        except FileExistsError:
            lost.append(letter)

    threads = [threading.Thread(target=create, args=(letter,)) for letter in (b"w", b"x", b"y", b"z")]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert (len(won), len(lost)) == (1, 3)
    assert file.read_bytes() == won[0] * 1000
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.parametrize("links", [True, False])
def test_the_content_is_on_the_disk_before_a_file_gets_its_name(tmp_path, monkeypatch, links):
    """Otherwise a power cut leaves the name with an empty file, and a search whose options are empty is lost."""
    made, replaced, stored, named = tmp_path / "made", tmp_path / "replaced", {}, []
    fsync, link = os.fsync, os.link

    def sync(descriptor):
        status = os.fstat(descriptor)
        stored[status.st_ino] = status.st_size
        fsync(descriptor)

    def name(rename, source, target):
        if rename is link and not links:
            raise OSError(errno.EPERM, "no hard links here")
        assert stored[source.stat().st_ino] == source.stat().st_size > 0
        named.append(target)
        rename(source, target)

    monkeypatch.setattr("os.fsync", sync)
    monkeypatch.setattr("os.link", partial(name, link))
    monkeypatch.setattr("os.replace", partial(name, os.replace))
    create_at_once(made, b"options")
    with replaced_at_once(replaced) as file:
        file.write(b"results")
    assert named == ([made, replaced] if links else [replaced])
    assert stored[made.stat().st_ino] == len(b"options")
