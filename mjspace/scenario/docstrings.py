"""The string below each field of a class, which Python does not keep."""

import ast
import inspect
from functools import cache
from itertools import pairwise


@cache
def docstrings(kind: type) -> dict[str, str]:
    """Return the string below each field of the class, by the field's name.

    Pydantic reads them too, but at every start of mjspace, which takes 0.3 s.
    """
    module = inspect.getmodule(kind)
    assert module is not None
    tree = ast.parse(inspect.getsource(module))
    classes = {node.name: node for node in ast.walk(tree) if isinstance(node, ast.ClassDef)}
    if kind.__name__ not in classes:  # a generic one with its parameters
        return {}
    found = {}
    for field, below in pairwise(classes[kind.__name__].body):
        match field, below:
            case ast.AnnAssign(target=ast.Name(name)), ast.Expr(ast.Constant(str(text))):
                found[name] = inspect.cleandoc(text)
    return found
