"""Arrays of numpy and tensors of torch, whichever there are; torch is imported only where there are tensors."""

from typing import Any

import numpy as np
from numpy.typing import NDArray


def on_host(values: Any) -> Any:
    """Return tensors, or a dictionary of them, as arrays; arrays stay what they are."""
    if isinstance(values, dict):
        return {name: on_host(rows) for name, rows in values.items()}
    return values.detach().cpu().numpy() if _is_tensor(values) else values


def torch_there(rows: NDArray[Any], device: str) -> Any:
    """Return an array as a tensor on a device, which shares its memory on the host."""
    import torch

    return torch.from_numpy(rows).to(device)


def copied(rows: Any) -> Any:
    """Return a copy of the same kind."""
    return rows.clone() if _is_tensor(rows) else rows.copy()


def put(target: Any, places: NDArray[np.intp], rows: Any) -> None:
    """Put rows at some places of a larger array or tensor."""
    if not _is_tensor(target):
        target[places] = rows
        return
    import torch

    if target.dtype == torch.uint16:  # for which torch has no such operation
        target, rows = target.view(torch.int16), rows.view(torch.int16)
    target[torch.from_numpy(places).to(target.device)] = rows


def _is_tensor(values: Any) -> bool:
    return hasattr(values, "detach")
