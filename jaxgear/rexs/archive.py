"""Containers of REXS files: .rexsz and .zip hold one model beside files that it refers to.

Nothing is unpacked to the disk, so that names of members are no paths, and no more than a limit is ever expanded.
"""

import io
import struct
import zipfile
import zlib
from pathlib import PurePosixPath

from ..io.errors import DesignFileError

SUFFIXES = (".rexsz", ".zip")
MODELS = (".rexs", ".xml", ".rexsj", ".json")
_START = b"PK\x03\x04"
_MOST = 256 * 2**20  # of a model [bytes]: a gearbox of a hundred gears has a few million
_MOST_MEMBERS = 10_000
_ENCRYPTED = 0x1  # flag of a member
_KNOWN = zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED
# what Python raises for one, offsets beyond the file and, as a RuntimeError, a version that it does not know included
_DAMAGED = zipfile.BadZipFile, zlib.error, EOFError, ValueError, IndexError, RuntimeError, struct.error


def is_container(held: bytes) -> bool:
    """Whether the content of a file is a zip archive."""
    return held.startswith(_START)


def unpacked(held: bytes) -> bytes:
    """The one model in a zip archive.

    Raises:
        DesignFileError: for an archive that is damaged or encrypted, has no model or several, or one of more than
            256 MiB.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(held)) as archive:
            if len(archive.infolist()) > _MOST_MEMBERS:
                raise DesignFileError("", f"holds {len(archive.infolist())} files, must be at most {_MOST_MEMBERS}")
            found = _model(archive)
            if found.flag_bits & _ENCRYPTED or found.compress_type not in _KNOWN:
                raise DesignFileError("", f"{found.filename}: is encrypted or compressed other than by deflate")
            with archive.open(found) as member:
                content = member.read(_MOST + 1)
    except DesignFileError:
        raise
    except _DAMAGED as error:
        raise DesignFileError("", f"is not a valid zip archive: {str(error) or 'it ends too early'}") from None
    if len(content) > _MOST:
        raise DesignFileError("", f"{found.filename}: expands to more than {_MOST >> 20} MiB")
    return content


def _model(archive: zipfile.ZipFile) -> zipfile.ZipInfo:
    members = [each for each in archive.infolist() if not each.is_dir()]
    models = [each for each in members if PurePosixPath(each.filename).suffix.lower() in MODELS]
    own = [each for each in models if PurePosixPath(each.filename).suffix.lower() in (".rexs", ".rexsj")] or models
    if len(own) == 1:
        return own[0]
    if not own:
        raise DesignFileError("", f"holds no REXS file, whose name ends in {', '.join(MODELS)}")
    shown = ", ".join(each.filename for each in own[:5])
    raise DesignFileError("", f"holds {len(own)} REXS files, unpack it and give one of them: {shown}")


def packed(content: bytes, name: str) -> bytes:
    """A zip archive of one model."""
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(name, content)
    return held.getvalue()
