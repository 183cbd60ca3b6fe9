"""The modules of the package import one way."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from importlib.util import resolve_name
from pathlib import Path

import pytest

import pysplatkit

ROOT = Path(pysplatkit.__file__).parent


def _modules() -> dict[str, Path]:
    """Returns the names of all modules, and their files."""
    modules = {}
    for path in ROOT.rglob("*.py"):
        parts = path.relative_to(ROOT.parent).with_suffix("").parts
        modules[".".join(part for part in parts if part != "__init__")] = path
    return modules


def _statements(tree: ast.AST) -> Iterator[ast.ImportFrom]:
    """Returns the imports of a module, those within functions too. Types alone make no circle."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            continue
        if isinstance(node, ast.ImportFrom) and node.level > 0:
            yield node
        yield from _statements(node)


def _imports(name: str, path: Path, modules: dict[str, Path]) -> set[str]:
    """Returns the modules that a module imports. A package is there for what lies below it."""
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    imported = set()
    for node in _statements(ast.parse(path.read_text("utf-8"))):
        source = resolve_name("." * node.level + (node.module or ""), package)
        for alias in node.names:
            whole = f"{source}.{alias.name}"
            imported.add(whole if whole in modules else source)
    return {other for other in imported & modules.keys() if not f"{name}.".startswith(f"{other}.")}


def test_modules_import_one_way() -> None:
    modules = _modules()
    graph = {name: _imports(name, path, modules) for name, path in modules.items()}
    assert "pysplatkit._options" in graph["pysplatkit._scene"], "no imports were found"
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" imports ".join(reversed(error.args[1])))
