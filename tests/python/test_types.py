"""The stubs say what the module has, and everything has a docstring."""

import ast
import inspect
from pathlib import Path

import touchstone as ts
from common import TestCase
from touchstone import _core


STUB = ast.parse(Path(_core.__file__).with_name("_core.pyi").read_text())


class Types(TestCase):
    def test_the_stubs_are_complete(self):
        def names(body):
            for node in body:
                if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
                    yield node.name
                elif isinstance(node, ast.AnnAssign):
                    yield node.target.id
                elif isinstance(node, ast.Assign) and body is not STUB.body:  # the members of an enumeration
                    yield node.targets[0].id

        def public(thing):
            return {name for name in vars(thing) if not name.startswith("_")}

        self.assertEqual({n for n in names(STUB.body) if not n.startswith("_")}, public(_core))
        for node in STUB.body:
            if isinstance(node, ast.ClassDef):
                of_class = {n for n in names(node.body) if not n.startswith("_")}
                self.assertEqual(of_class, public(getattr(_core, node.name)), node.name)

    def test_the_stubs_have_the_arguments(self):
        seen = 0
        for node in ast.walk(STUB):
            if not isinstance(node, ast.FunctionDef) or node.name.startswith("__") and node.name != "__init__":
                continue
            owner = next((c for c in STUB.body if isinstance(c, ast.ClassDef) and node in c.body), None)
            thing = getattr(getattr(_core, owner.name) if owner else _core, node.name)
            if isinstance(thing, property) or node.args.kwarg or owner and owner.name == "SceneError":
                continue
            if node.decorator_list and getattr(node.decorator_list[0], "id", "") == "property":
                self.fail(f"{node.name} is no property")
            arguments = [a.arg for a in node.args.args + node.args.kwonlyargs]
            first = thing.__doc__.splitlines()[0]
            for name in arguments:
                self.assertRegex(first, rf"[(, ]{name}: ", f"{node.name}: {first}")
            seen += 1
        self.assertGreater(seen, 20)

    def test_everything_public_has_a_docstring(self):
        for name in ts.__all__:
            thing = getattr(ts, name)
            if inspect.isclass(thing) or inspect.isfunction(thing) or inspect.isbuiltin(thing):
                self.assertTrue(thing.__doc__ or name == "SceneError", name)

    def test_an_older_processor_is_told_apart(self):
        from touchstone import _processor

        new, old = "processor: 0\nflags\t\t: fpu sse2 avx avx2 bmi2 fma\n", "flags\t\t: fpu sse2 avx\n"
        self.assertFalse(_processor.lacks("x86-64-v3", new))
        self.assertTrue(_processor.lacks("x86-64-v3", old))
        self.assertFalse(_processor.lacks("native", old))
        self.assertFalse(_processor.lacks("x86-64-v3", ""))
