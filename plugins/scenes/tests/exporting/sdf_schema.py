"""SDFormat's own XML schema, as Debian has it, and libxml2's check by it."""

import os
import subprocess
from pathlib import Path

VERSION = "1.9"
URI = "http://sdformat.org/schemas/"
HEAD = '<xsd:schema xmlns:xsd="http://www.w3.org/2001/XMLSchema">'
MENDED = {
    # These two are missing in the package, or stand twice in it; no scene has either.
    "navsat": '<xsd:element name="navsat"/>',
    "state": '<xsd:element name="state"/>',
    # The package's lets a pose have attributes and no numbers.
    "pose": """<xsd:element name="pose"><xsd:complexType><xsd:simpleContent><xsd:extension base="numbers_6">
        <xsd:attribute name="relative_to" type="xsd:string"/></xsd:extension></xsd:simpleContent></xsd:complexType>
        </xsd:element>""",
    # Names of lists of so many numbers, likewise missing.
    "types": '<xsd:simpleType name="numbers"><xsd:list itemType="xsd:double"/></xsd:simpleType>'
    + "".join(
        f'<xsd:simpleType name="{name}"><xsd:restriction base="numbers"><xsd:length value="{length}"/>'
        "</xsd:restriction></xsd:simpleType>"
        for name, length in {"vector2d": 2, "vector3": 3, "color": 4, "pose": 6, "numbers_6": 6, "time": 1}.items()
    ),
}


def errors(path: Path, work: Path) -> list[str]:
    """What is not as the schema says, a line each; `work` is an empty folder."""
    (folder,) = Path("/usr/share").glob(f"sdformat*/{VERSION}")
    lines = []
    for name, text in MENDED.items():
        (work / f"{name}.xsd").write_text(f"{HEAD}{text}</xsd:schema>")
        lines.append(f'<system systemId="{URI}{name}.xsd" uri="{(work / name).as_uri()}.xsd"/>')
    lines.append(f'<rewriteSystem systemIdStartString="{URI}" rewritePrefix="{folder.as_uri()}/"/>')
    catalog = work / "catalog.xml"
    head = '<catalog xmlns="urn:oasis:names:tc:entity:xmlns:xml:catalog">'
    catalog.write_text(f"{head}{''.join(lines)}</catalog>")
    done = subprocess.run(
        ["xmllint", "--nonet", "--noout", "--schema", f"{URI}root.xsd", str(path)],
        env={**os.environ, "XML_CATALOG_FILES": str(catalog)},
        capture_output=True,
        text=True,
        check=False,
    )
    told = done.stderr.strip().splitlines()
    assert (done.returncode == 0) == told[-1].endswith(" validates"), done.stderr
    return told[:-1]
