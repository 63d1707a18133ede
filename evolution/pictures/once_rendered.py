"""A figure that is rendered once for each file. Matplotlib renders a figure with a layout twice."""

from __future__ import annotations

from typing import Any

from matplotlib.backend_bases import RendererBase
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine


class OnceRenderedFigure(Figure):
    """A figure with a constrained layout that :meth:`savefig` renders once.

    ``savefig`` of Matplotlib first renders into nothing, and then again without a layout engine. The first time
    only the layout is computed: it is all that the second time needs, and the bytes of the file are the same.
    """

    _is_saved = False

    def savefig(self, fname: Any, **options: Any) -> None:
        """Write the figure into a file; arguments are those of Matplotlib."""
        self._is_saved = True
        try:
            super().savefig(fname, **options)
        finally:
            self._is_saved = False

    def draw(self, renderer: RendererBase) -> None:
        """Compute the layout alone if a file is written and there is a layout engine; render otherwise."""
        engine = self.get_layout_engine()
        if self._is_saved and isinstance(engine, ConstrainedLayoutEngine):
            engine.execute(self)
        else:
            super().draw(renderer)
