"""Results of ranks and tasks."""

from __future__ import annotations

from typing import Any

import ray

from .._errors import Error


def get(refs: Any) -> Any:
    """Waits for results. Errors are those of the package."""
    try:
        return ray.get(refs)
    except ray.exceptions.RayTaskError as error:
        if isinstance(error.cause, Exception):
            raise error.cause from None
        raise Error(str(error)) from error
    except ray.exceptions.OutOfMemoryError as error:
        raise Error(
            f"a process exceeds the memory of its node; use more ranks or parts: {error}"
        ) from error
    except (ray.exceptions.RayActorError, ray.exceptions.WorkerCrashedError) as error:
        raise Error(f"a process has died, again and again: {error}") from error
