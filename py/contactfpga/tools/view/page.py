"""How viser's page looks here: its panel under the sheet on a phone, and none of its own marks over the sheet."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import viser

PANEL_PX = 330
"""Width of the panel beside the sheet."""

STYLE = """
@media (max-width: 36em) {
  div:has(> .mantine-Paper-root[style*="bottom: 0"]) { flex-direction: column; }
  div:has(> .mantine-Paper-root[style*="bottom: 0"]) > div:has([data-dock-root]) { height: auto !important; min-height: 0; }
  .mantine-Paper-root[style*="bottom: 0"] {
    position: relative !important; width: 100% !important; max-height: 46% !important; flex-shrink: 0;
  }
  .mantine-Paper-root[style*="bottom: 0"] div[style*="width: 20em"] { width: auto !important; }
}
.contacts { width: 100%; border-collapse: collapse; font-size: 0.8rem; font-variant-numeric: tabular-nums; }
.contacts th { font-weight: 500; opacity: 0.65; text-align: right; padding: 0.1rem 0.3rem; }
.contacts td { text-align: right; padding: 0.1rem 0.3rem; white-space: nowrap; }
.contacts th:first-child, .contacts td:first-child { text-align: left; }
.contacts tbody tr { border-top: 1px solid var(--mantine-color-default-border); }
.contact-list { padding: 0.4rem 0.6rem; min-height: 8.2rem; }
.contact-list b { font-size: 0.95rem; }
"""

SCRIPT = """
(() => {
  const style = document.createElement("style");
  style.textContent = STYLE;
  document.head.append(style);
  addEventListener("pointerdown", () => {
    window.__viserTestpoints?.devSettings.set({enableOrbitCrosshair: false});
    for (const one of window.__viserMutable?.scene?.children ?? [])
      if (one.line && one.cone) one.line.visible = one.cone.visible = false;
  }, true);
})();
"""
"""Before a drag: without viser's arrow from its beginning to the mouse, and without the cross it turns around."""


def dress(server: viser.ViserServer) -> None:
    """For all who come. viser has no setting for any of this, but sends a script to the page where a part of it asks
    for one."""
    from viser import _messages

    server.gui.configure_theme(show_logo=False, show_share_button=False)
    server.gui.set_panel_label("contactfpga")
    server.gui.main_panel.dock_right()
    server.gui.main_panel.set_width(PANEL_PX)
    source = SCRIPT.replace("STYLE", json.dumps(STYLE))
    server._websock_server.queue_message(_messages.RunJavascriptMessage(source))
