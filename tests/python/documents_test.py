# SPDX-License-Identifier: Apache-2.0
"""docs/python.md works as typed, and the notebooks run."""

import re

import pytest

BOOKS = ["relight", "compensate", "own_rig"]


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
