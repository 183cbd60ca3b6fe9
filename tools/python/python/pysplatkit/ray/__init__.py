"""Drawing on a cluster, by Ray: pictures of scenes that one machine cannot hold, films, and
conversions in parts.

>>> import pysplatkit.ray
>>> renderer = pysplatkit.ray.Renderer("large.splv", ranks=16, memory=8 << 30)
>>> renderer.render((1920, 1080)).save("large.png")
>>> pysplatkit.ray.convert(["a.laz", "b.laz"], "both.splk", parts=64)

`docs/scale-ray.md` is the manual.
"""

from __future__ import annotations

try:
    import ray as _ray
except ImportError as error:
    raise ImportError(
        'pysplatkit.ray needs Ray: pip install "pysplatkit[ray]"', name="ray"
    ) from error

from ._convert import convert
from ._renderer import Renderer

del _ray

__all__ = ["Renderer", "convert"]
