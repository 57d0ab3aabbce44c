"""Words of the trade for the keys of a design file, and what to do where a word stands for another quantity.

Letters alone do not make a key: `root_diameter` is near `bore_diameter`, `transverse_module` ends with `module`, and a
number under the wrong key is wrong in silence. A key is suggested for the same quantity in the same unit (`_SAME`) or
for a misspelling of every part of its name; another quantity (`_OTHER`) gets the conversion.
"""

import difflib
import re
from collections.abc import Set

# Symbols and names of ISO 21771, ISO 53, ISO 6336, DIN and drawings, without underscores and the index of the gear; of
# keys with one symbol the first that its table knows is meant.
_SAME = {
    "teeth": "z toothnumber numberofteeth",
    "module": "m mn modul normalmodule",
    "pressure_angle": "alpha alphan alphap alpha0 normalpressureangle",
    "profile_shift": "x xstar profileshiftcoefficient addendummodificationcoefficient",
    "face_width": "b width facewidth gearwidth toothwidth",
    "helix_angle": "beta helix",
    "addendum": "hapstar hapcoefficient addendumcoefficient",
    "dedendum": "hfpstar hfpcoefficient dedendumcoefficient",
    "root_radius": "rhofpstar rootradiuscoefficient",
    "cutter_teeth": "z0 teethofcutter shaperteeth shapercutterteeth pinioncutterteeth",
    "cutter_profile_shift": "x0 shaperprofileshift cutterprofileshiftcoefficient",
    "tip_diameter": "da dk outsidediameter outerdiameter od addendumdiameter",
    "tip_form_diameter": "dfa dna activetipdiameter usabletipdiameter effectivetipdiameter chamferdiameter",
    "bore_diameter": "di bore innerdiameter",
    "root_diameter": "df",
    "root_form_diameter": "dff",
    "tip_chamfer": "chamfer tipchamferheight hk",
    "tooth_thickness_allowance": "esn esns asne as",
    "tooth_thickness_tolerance": "tsn ts",
    "span": "wk w basetangentlength",
    "teeth_spanned": "k",
    "over_balls": "mdk mdr mr overpins",
    "ball_diameter": "dm",
    "center_distance": "a aw centredistance centerdistance axisdistance",
    "backlash": "jn jbn normalbacklash",
    "torque": "t m",
    "speed": "n rpm",
    "friction": "mu frictioncoefficient",
    "elastic_modulus": "e youngsmodulus young",
    "poisson_ratio": "nu poissonsratio",
    "density": "rho",
    "amount": "ca caa caf cb calpha cbeta",
    "length": "lca lcaa lc",
    "viscosity_40": "nu40",
    "viscosity_100": "nu100",
    "temperature": "t theta thetaoil",
    "roughness": "ra",
    "quality_class": "quality accuracy accuracygrade tolerancegrade isoclass",
}

# Words of other quantities, written likewise, with what to do.
_OTHER = {
    "diametralpitch normaldiametralpitch dp pd": "is the inverse of a module: module = 25.4 mm / diametral pitch",
    "circularpitch": "is another measure: module = pitch / pi",
    "transversemodule mt": "is another number on helical gears: module = transverse module x cos(helix_angle)",
    "transversepressureangle alphat": (
        "is another angle on helical gears: tan(pressure_angle) = tan(alpha_t) cos(helix_angle)"
    ),
    "workingpressureangle operatingpressureangle alphaw alphawt": "follows from pair.center_distance",
    "helixanglerad betarad": "must be converted: helix_angle is in degrees",
    "basehelixangle betab": "is another angle: sin(helix_angle) = sin(beta_b) / cos(pressure_angle)",
    "lead leadheight pz": "is another measure: tan(helix_angle) = pi x reference diameter / lead",
    "leadangle gamma": "is the complement: helix_angle = 90 deg - lead angle",
    "hand handofhelix": "is the sign of helix_angle: positive for a right hand",
    "doublehelical herringbone": (
        "is entered as one of its halves: helix_angle, the face_width of a half, and half of the torque"
    ),
    "internal ringgear annulus": "is not covered: pinion and wheel have external teeth",
    "tipchamfer chamfer tipchamferheight hk": (
        "ends the involute early: tip_form_diameter = tip_diameter - 2 x height of the chamfer"
    ),
    "tiprounding tipradius": "is the radius of the tip edge: tip_edge_radius in mm",
    "addendummodification profileshiftmm xm": "is a length in mm: profile_shift = length / module",
    "ha hap addendumheight": "may be a length in mm: addendum is a coefficient, height of the rack in mm / module",
    "hf hfp dedendumheight": "may be a length in mm: dedendum is a coefficient, depth of the rack in mm / module",
    "rhof rhofp filletradius toolradius": "may be a length in mm: root_radius is a coefficient, radius in mm / module",
    "da0 dk0 cuttertipdiameter cutteroutsidediameter": (
        "follows from the cutter: dedendum = (d_a0 / module - cutter_teeth) / 2 - cutter_profile_shift"
    ),
    "rhoa0 cuttertipradius": "is a length in mm: root_radius = radius in mm / module",
    "rootdiameter df": "follows from the rack: dedendum = (d - d_f) / (2 module) + profile_shift",
    "rootformdiameter dff": "follows from the rack and the pressure angle",
    "activerootdiameter usablerootdiameter effectiverootdiameter dnf sap": (
        "follows from the mate's tip: end that at its tip_form_diameter"
    ),
    "referencediameter pitchdiameter operatingpitchdiameter d dw": "follows from teeth, module and helix_angle",
    "basediameter db": "follows from teeth, module, pressure_angle and helix_angle",
    "toothdepth toothheight h": "is the sum of both: give addendum and dedendum as coefficients of the module",
    "gearratio transmissionratio ratio i u": "follows from the teeth of pinion and wheel",
    "circumferentialbacklash transversebacklash jt jwt": (
        "is longer than pair.backlash along the line of action: backlash = j_wt cos(alpha_wt) cos(beta_b)"
    ),
    "radialbacklash jr": "is another direction: backlash = 2 j_r sin(alpha_wt) cos(beta_b)",
    "angularbacklash jphi": "is an angle: backlash = angle in rad x base radius in um x cos(beta_b)",
    "backlash jn jbn": "is the key of the table [pair]",
    "tooththickness sn st s": ("is given by its allowance or a measure: tooth_thickness_allowance, span or over_balls"),
    "applicationfactor ka dynamicfactor kv servicefactor overloadfactor loadfactor": (
        "is no input of the contact analysis: multiply load.torque by it for stresses; losses and temperatures are "
        "then those of the larger torque too"
    ),
    "facloadfactor faceloadfactor khbeta khb kfbeta transverseloadfactor khalpha kha": "is a result",
    "wheeltorque outputtorque torquewheel torqueoutput": "is on the other shaft: load.torque = torque x z1 / z2",
    "wheelspeed outputspeed speedwheel speedoutput": "is of the other shaft: load.speed = speed x z2 / z1",
    "power p": "is given by torque and speed: torque in N m = 9549 x power in kW / speed in rpm",
    "tangentialforce ft": "is given by the torque: torque in N m = F_t in N x reference diameter in mm / 2000",
    "angularvelocity omega": "is given in rpm: speed = 9.549 x angular velocity in rad/s",
    "hardness heattreatment treatment steel grade": (
        "does not change deflections: material names the elastic constants, see [materials]"
    ),
    "tiprelief rootrelief crowning leadcrowning profilecrowning endrelief": (
        'is a modification: [[pinion.modification]] with type = "tip_relief", "lead_crowning" ...'
    ),
    "agmaquality qualitynumber": "is counted the other way: quality_class is that of ISO 1328-1, about 17 - Q",
}
_ADVICE = {word: advice for words, advice in _OTHER.items() for word in words.split()}
_TABLES = "teeth", "torque", "center_distance", "pinion"  # a key of each of the tables that these words belong to
_COEFFICIENTS = "addendum", "dedendum", "root_radius", "profile_shift", "cutter_profile_shift"
_PART, _WHOLE = 0.7, 0.85  # similarity of a misspelt part, and of a name with its parts run together


def unknown_key(name: str, keys: Set[str]) -> str:
    """Problem with a key that a table does not know: its meaning in the trade, the key that was misspelt, or all keys.

    Args:
        name: unknown key.
        keys: keys of its table.
    """
    plain = _plain(name)
    same = next((key for key, words in _SAME.items() if key in keys and plain in words.split()), "")
    if same:
        return f'unknown key, did you mean "{same}"' + (", in modules?" if same in _COEFFICIENTS else "?")
    if plain in _ADVICE and not keys.isdisjoint(_TABLES):
        return f"unknown key, {_ADVICE[plain]}"
    near = [key for key in difflib.get_close_matches(name, keys, n=3, cutoff=0.5) if is_misspelt(name, key)]
    if near:
        return f'unknown key, did you mean "{near[0]}"?'
    return f"unknown key, must be one of {', '.join(sorted(keys))}" if keys else "unknown key, nothing is allowed here"


def is_misspelt(name: str, key: str) -> bool:
    """True if every part of a name is near its counterpart in the key, or the whole is but for underscores."""
    parts, wanted = name.lower().split("_"), key.split("_")
    if len(parts) != len(wanted):
        return _near("".join(parts), "".join(wanted), _WHOLE)
    return all(_near(part, whole, _PART) for part, whole in zip(parts, wanted))


def _near(word: str, wanted: str, least: float) -> bool:
    return difflib.SequenceMatcher(None, word, wanted).ratio() >= least


def _plain(name: str) -> str:
    """A name without underscores, hyphens and the index of the gear."""
    return re.sub("[_-]", "", name).lower().rstrip("12")


def remark_on(key: str, value: object) -> str:
    """Further words on a value that its key refuses: ": " and what to do, "" for nothing.

    Args:
        key: dotted key.
        value: refused number or text.
    """
    name = key.rpartition(".")[2].partition("[")[0]
    if isinstance(value, str):
        comma = re.fullmatch(r"\s*([+-]?\d+),(\d+)\s*", value)
        if comma:
            return f": write {comma[1]}.{comma[2]} without quotes, with a decimal point"
        grade = re.fullmatch(r"\s*(?:ISO|A)?\s*(\d+)\s*", value, re.IGNORECASE)
        if name == "quality_class" and grade:
            return f": write the number of the ISO 1328-1 class alone, {name} = {grade[1]}"
        return f": {_ADVICE['agmaquality']}" if name == "quality_class" else ""
    if name == "teeth" and isinstance(value, int | float) and value < 0:
        return f": a negative number means an internal gear, which {_ADVICE['internal']}"
    return ""
