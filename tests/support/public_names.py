"""Every public name of magshell, found."""

import magshell as ms


def public_names(module=ms, prefix="") -> set[str]:
    """Return the names that users call, including those in modules."""
    names = set()
    for name in module.__all__ if hasattr(module, "__all__") else _defined_in(module):
        each = getattr(module, name)
        if name.startswith("_"):
            continue
        if hasattr(each, "__path__") or each.__class__.__name__ == "module":
            names |= public_names(each, f"{prefix}{name}.")
        else:
            names.add(prefix + name)
    return names


def _defined_in(module) -> list[str]:
    return [
        name for name, each in vars(module).items() if getattr(each, "__module__", None) == module.__name__
    ]
