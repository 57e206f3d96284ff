"""Changes of viser's page, and a picture of it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import viser

PANEL_PX = 330

STYLE = """
@media (max-width: 36em) {
  :has(> .mantine-Paper-root[style*="bottom: 0"]) { flex-direction: column; }
  :has(+ .mantine-Paper-root[style*="bottom: 0"]) { height: auto !important; min-height: 0; }
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
.chart { padding: 0 0.6rem; }
.contact-list b { font-size: 0.95rem; }
"""

SCRIPT = """
(() => {
  const style = document.createElement("style");
  style.textContent = STYLE;
  document.head.append(style);
  document.title = "contactfpga";
  setInterval(() => {
    for (const notice of document.querySelectorAll(".mantine-Notification-root"))
      if (notice.textContent.includes("Software WebGL"))
        notice.querySelector(".mantine-Notification-closeButton")?.click();
  }, 1000);
  addEventListener("pointerdown", () => {
    window.__viserTestpoints?.devSettings.set({enableOrbitCrosshair: false});
    for (const one of window.__viserMutable?.scene?.children ?? [])
      if (one.line && one.cone) one.line.visible = one.cone.visible = false;
  }, true);
  window.contactfpgaPicture = (lines) => {
    const seen = window.__viserMutable.canvas, card = document.createElement("canvas");
    const size = 14 * seen.width / seen.clientWidth, step = 1.6 * size;
    card.width = seen.width;
    card.height = seen.height + step * (lines.length + 1);
    const pen = card.getContext("2d"), colors = getComputedStyle(document.body);
    pen.fillStyle = colors.backgroundColor;
    pen.fillRect(0, 0, card.width, card.height);
    pen.drawImage(seen, 0, 0);
    pen.fillStyle = colors.color;
    lines.forEach((line, number) => {
      pen.font = `${number ? "" : "bold "}${size}px sans-serif`;
      pen.fillText(line, size, seen.height + step * (number + 1));
    });
    card.toBlob((file) => {
      const link = document.createElement("a");
      link.href = URL.createObjectURL(file);
      link.download = "contactfpga.png";
      link.click();
      URL.revokeObjectURL(link.href);
    });
  };
})();
"""
"""Script that names the tab, moves viser's panel on phones, removes its own marks, closes its notice of slow drawing,
which covers the sheet, and saves a picture with lines of text."""


def dress(server: viser.ViserServer) -> None:
    """Apply the changes for all clients, by the scripts that parts of viser's page ask for."""
    server.gui.configure_theme(show_logo=False, show_share_button=False)
    server.gui.set_panel_label("contactfpga")
    server.gui.main_panel.dock_right()
    server.gui.main_panel.set_width(PANEL_PX)
    _run(server._websock_server, SCRIPT.replace("STYLE", json.dumps(STYLE)))


def picture(client: Any, lines: Sequence[str]) -> None:
    """Make this browser save its view as `contactfpga.png`, with these lines below."""
    _run(client._websock_connection, f"window.contactfpgaPicture({json.dumps(list(lines))})")


def _run(to: Any, source: str) -> None:
    from viser import _messages

    to.queue_message(_messages.RunJavascriptMessage(source))
