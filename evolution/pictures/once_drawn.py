"""A figure that is drawn once for each file. Matplotlib draws a figure with a layout twice."""

from __future__ import annotations

from matplotlib.backend_bases import RendererBase
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine


class OnceDrawnFigure(Figure):
    """A figure with a constrained layout, for :meth:`savefig` alone.

    ``savefig`` first draws with a renderer that draws nothing, and then again without a layout engine. The first time
    only the layout is computed: it is all that the second time needs, and the bytes of the file are the same.
    """

    def draw(self, renderer: RendererBase) -> None:
        """Compute the layout if there is a layout engine, draw otherwise."""
        engine = self.get_layout_engine()
        if isinstance(engine, ConstrainedLayoutEngine):
            engine.execute(self)
        else:
            super().draw(renderer)
