"""Handles on bristles, by Dahl's model and by LuGre's, and the keys that give a scene the section."""

from hardwall.sim.world.presliding import bristled
from hardwall.sim.world.rigid import Handle

COULOMB_N, STATIC_N, STRIBECK = 0.1, 0.15, 1e-3
DAHL_KEYS = {"presliding.model": "dahl", "presliding.stiffness_n_per_m": 1e5}
LUGRE_KEYS = {
    "presliding.model": "lugre", "presliding.stiffness_n_per_m": 1e5, "presliding.damping_n_s_per_m": 300.0,
    "presliding.static_n": STATIC_N, "presliding.stribeck_m_per_s": STRIBECK,
}  # fmt: skip
HANDLE = Handle(0.35, 0.3)
DAHL = bristled(HANDLE, COULOMB_N, 1e5, 0.0, COULOMB_N, 1.0)
LUGRE = bristled(HANDLE, COULOMB_N, 1e5, 300.0, STATIC_N, STRIBECK)
