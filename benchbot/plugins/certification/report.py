"""The files of a certificate: a page for people, JSON for programs, a line of Markdown for a README."""

import json
from pathlib import Path

from benchbot.core import atomic
from benchbot.core.text import visible
from benchbot.plugins.certification.certificate import Certificate

TEMPLATE = Path(__file__).with_name("certificate.html")


def write(certificate: Certificate, folder: Path) -> list[Path]:
    """Write `certificate.html`, `certificate.json` and `badge.md`, and return their paths."""
    texts = {
        "certificate.html": page(certificate),
        "certificate.json": json.dumps(certificate.as_dict(), indent=1, ensure_ascii=False),
        "badge.md": certificate.badge,
    }
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        atomic.write_text(folder / name, f"{visible(text)}\n")
    return [folder / name for name in texts]


def page(certificate: Certificate) -> str:
    """Return the page: one HTML file that needs no other, no network and no script."""
    from jinja2 import Environment, StrictUndefined

    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    environment.filters["score"] = lambda value: "–" if value is None else f"{value:.3f}"
    environment.filters["signed"] = lambda value: "–" if value is None else f"{value:+.3f}"
    return environment.from_string(TEMPLATE.read_text("utf-8")).render(certificate=certificate)
