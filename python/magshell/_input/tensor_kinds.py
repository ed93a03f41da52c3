"""Checks whether the numbers of a torch tensor can be read, without importing torch."""

from __future__ import annotations

import sys

import numpy as np

_BATCHED = (
    "is inside torch.vmap with another value for each member, or inside is_grads_batched, which cannot look into a solve: "
    "loop over designs, or over gradients with torch.func.jacrev, which calls them one at a time"
)
_DEEPEST = 5  # axes of any input, and one more


def is_tensor(value) -> bool:
    """Return whether a value is a torch tensor; False if torch has not been imported."""
    torch = sys.modules.get("torch")
    return torch is not None and isinstance(value, torch.Tensor)


def is_followed(tensor) -> bool:
    """Return whether torch differentiates by a tensor: it requires a gradient, or is inside a transform."""
    from ..solve.adjoint.autograd import is_transformed

    return tensor.requires_grad or is_transformed(tensor)


def numbers_of(tensor) -> np.ndarray:
    """Return the numbers of a readable tensor, without its graph. bfloat16, which numpy lacks, becomes float32."""
    from ..solve.adjoint.autograd import is_transformed, outside_transforms, within_transform

    if is_transformed(tensor) or within_transform():  # which wraps what it detaches
        return outside_transforms(tensor, numbers_of)
    plain = tensor.detach().cpu().resolve_conj().resolve_neg()
    return (plain.float() if plain.dtype == sys.modules["torch"].bfloat16 else plain).numpy()


def numbers_refusing(numbers: np.ndarray, source, why: str):
    """Return numbers as a tensor that torch differentiates by `source`: where it does, NoGradient says why there is none."""
    from ..solve.adjoint.autograd import numbers_refusing

    return numbers_refusing(numbers, source, why)


def why_not(values) -> str:
    """Say why the numbers of a tensor, or of a list with tensors, cannot be read, and what to do instead.

    Returns "" if they can be read, and for anything that is no tensor.
    """
    if is_tensor(values):
        return _why_not(sys.modules["torch"], values)
    return _why_not_all(values, _DEEPEST) if "torch" in sys.modules else ""


def _why_not(torch, tensor) -> str:
    from ..solve.adjoint.autograd import is_batched

    if is_batched(tensor):
        return _BATCHED
    if tensor.is_nested:
        return "is a nested tensor: hand over its parts one by one"
    if tensor.layout != torch.strided:
        return f"is sparse ({tensor.layout}): hand over .to_dense()"
    if tensor.device.type == "meta" or type(tensor).__name__ == "FakeTensor":
        return "has a shape but no numbers (a meta or fake tensor): hand over one on a device that computes"
    if tensor.is_quantized:
        return f"is quantized ({tensor.dtype}): hand over .dequantize()"
    taken = torch.float64, torch.float32, torch.float16, torch.bfloat16
    if tensor.is_floating_point() and tensor.dtype not in taken:
        return f"has dtype {tensor.dtype}, which is too coarse: hand over .to(torch.float64)"
    return ""


def _why_not_all(values, depth: int) -> str:
    if not isinstance(values, list | tuple) or depth == 0:
        return ""
    for part in values:
        if not is_tensor(part):
            why = _why_not_all(part, depth - 1)
        elif is_followed(part):
            why = (
                "is a list of tensors, of which some require a gradient that would be lost: torch.stack them"
            )
        elif part.dtype == sys.modules["torch"].bfloat16:
            why = "is a list of tensors, of which some are bfloat16: torch.stack them"
        else:
            why = (why := why_not(part)) and f"is a list, and a tensor in it {why}"
        if why:
            return why
    return ""
