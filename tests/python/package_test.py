# SPDX-License-Identifier: Apache-2.0
"""Types, names, symbols and documents of the package; docs/python.md works as typed, and the notebooks run."""

import inspect
import pathlib
import re
import subprocess
import sys

import pytest

import symrig

FOLDER = pathlib.Path(symrig.__file__).parent
MYPY = ["--strict", "--allow-subclassing-any", "--ignore-missing-imports", "--python-executable", sys.executable]
BOOKS = ["relight", "compensate", "own_rig"]


def run_mypy(*words):
    pytest.importorskip("mypy")
    return subprocess.run([sys.executable, "-m", "mypy", *MYPY, "--cache-dir=/dev/null", *words], capture_output=True, text=True, cwd=FOLDER.parent, check=False)


@pytest.mark.once
def test_types_are_right_and_are_seen_from_outside(tmp_path):
    """One run of mypy: the package itself, and a user's file with one planted error."""
    (tmp_path / "user.py").write_text(
        "import symrig\n"
        "scene = symrig.load('scene.h5')\n"
        "width: int = scene.light_shape[1]\n"
        "scene.errors()['flood'].value + 1.0\n"
        "wrong: str = symrig.open_rig('sim:plane').channels\n"
    )
    done = run_mypy("-p", "symrig", "--no-error-summary")
    assert done.returncode == 0, done.stdout
    done = run_mypy(str(tmp_path / "user.py"), "--no-error-summary")
    assert done.stdout.count("error:") == 1 and "user.py:5" in done.stdout, done.stdout


def test_the_stub_has_what_the_module_has():
    module = symrig._symrig
    stub = (FOLDER / "_symrig.pyi").read_text()
    stubbed = set(re.findall(r"^(?:def|class) (\w+)|^(\w+):", stub, re.MULTILINE))
    stubbed = {one or other for one, other in stubbed}
    assert stubbed == {name for name in vars(module) if not name.startswith("__")}
    for cls in re.findall(r"^class (\w+):", stub, re.MULTILINE):
        body = re.search(rf"^class {cls}:\n((?:    .*\n|\n)+)", stub, re.MULTILINE).group(1)
        named = set(re.findall(r"^    def (\w+)", body, re.MULTILINE)) - {"__init__"}
        assert named == {name for name in vars(getattr(module, cls)) if not name.startswith("_")}, cls


def test_every_public_name_is_documented():
    for name in symrig.__all__:
        thing = getattr(symrig, name)
        if not callable(thing):
            continue
        assert inspect.getdoc(thing), name
        if inspect.isclass(thing) and thing.__module__.startswith("symrig"):
            for member, value in vars(thing).items():
                if not member.startswith("_") and (inspect.isfunction(value) or isinstance(value, property)):
                    assert inspect.getdoc(value), f"{name}.{member}"


def test_the_module_shows_no_symbol_of_the_library():
    names = subprocess.run(["nm", "-DC", "--defined-only", symrig._symrig.__file__], capture_output=True, text=True, check=True).stdout
    assert "PyInit__symrig" in names
    assert not re.findall(r"symrig::|H5|TransportTensor", names.replace("PyInit__symrig", ""))


def test_errors_have_code_cause_and_next_step():
    assert issubclass(symrig.InputError, ValueError) and issubclass(symrig.Interrupted, symrig.LimitError)
    with pytest.raises(symrig.Error) as failure:
        symrig.load("none.h5")
    assert (failure.value.code, failure.value.name) == (300, "not_found")
    assert failure.value.cause and str(failure.value) == f"{failure.value.cause}; {failure.value.next_step}"


@pytest.mark.once
def test_the_wheel_installs_and_works(root, groove_file, tmp_path):
    """Unpacked as an installer does; every file is in RECORD with its digest."""
    import base64
    import csv
    import hashlib
    import zipfile

    build = FOLDER.parents[2]
    done = subprocess.run([sys.executable, "-B", root / "tools/wheel", build, tmp_path], capture_output=True, text=True, check=True)
    wheel = pathlib.Path(done.stdout.strip())
    assert re.fullmatch(r"symrig-[\d.]+-cp3\d+-cp3\d+-linux_\w+\.whl", wheel.name)
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path / "site")
        names = archive.namelist()
    info = next(name for name in names if name.endswith("RECORD"))
    rows = list(csv.reader((tmp_path / "site" / info).read_text().splitlines()))
    assert {row[0] for row in rows} == set(names)
    for name, digest, size in rows[:-1]:
        data = (tmp_path / "site" / name).read_bytes()
        assert len(data) == int(size)
        assert digest == "sha256=" + base64.urlsafe_b64encode(hashlib.sha256(data).digest()).decode().rstrip("=")
    script = f"import symrig; print(symrig.__file__, symrig.load({str(groove_file)!r}).shape)"
    done = subprocess.run([sys.executable, "-c", script], env={"PYTHONPATH": str(tmp_path / "site")}, capture_output=True, text=True, check=True)
    assert str(tmp_path / "site") in done.stdout and "(768, 768)" in done.stdout


@pytest.mark.parametrize("built, message", [(None, "is not built; run "), ("_symrig.cpython-399-x86_64-linux-gnu.so", "was built for another Python: it has {built}")])
def test_an_import_that_fails_says_why(tmp_path, built, message):
    package = tmp_path / "symrig"
    package.mkdir()
    for file in FOLDER.glob("*.py"):
        (package / file.name).write_text(file.read_text())
    if built:
        (package / built).write_bytes(b"")
    done = subprocess.run([sys.executable, "-B", "-c", "import symrig"], capture_output=True, text=True, cwd=tmp_path, env={}, check=False)
    last = done.stderr.strip().splitlines()[-1]
    assert done.returncode == 1 and "circular" not in done.stderr, done.stderr
    assert last.startswith(f"ImportError: symrig in {package} ") and message.format(built=built) in last, last


def test_the_page_works_as_typed(root, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "examples").symlink_to(root / "examples")
    text = (root / "docs/python.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    assert len(blocks) >= 10
    names = {"__name__": "page"}
    for block in blocks:
        line = text[: text.index(block)].count("\n")
        exec(compile("\n" * line + block, "docs/python.md", "exec"), names)  # errors then name the page's line
    assert (tmp_path / "relit.exr").exists() and names["found"].shape == (64, 64)


def test_every_notebook_has_a_test(root):
    assert sorted(path.stem for path in (root / "examples/notebooks").glob("*.ipynb")) == sorted(BOOKS)


@pytest.mark.once
@pytest.mark.parametrize("name", BOOKS)
def test_a_notebook_runs(name, root, tmp_path):
    nbclient = pytest.importorskip("nbclient")
    nbformat = pytest.importorskip("nbformat")
    pytest.importorskip("ipykernel")
    book = nbformat.read(root / "examples/notebooks" / f"{name}.ipynb", as_version=4)
    nbformat.validate(book)
    assert not any(cell.get("outputs") for cell in book.cells), "notebooks are kept without outputs"
    nbclient.NotebookClient(book, kernel_name="python3", timeout=None, resources={"metadata": {"path": str(tmp_path)}}).execute()
    shown = [output for cell in book.cells for output in cell.get("outputs", [])]
    assert any("data:image/png" in output.get("data", {}).get("text/html", "") for output in shown)
    nbformat.write(book, tmp_path / f"{name}.ipynb")
