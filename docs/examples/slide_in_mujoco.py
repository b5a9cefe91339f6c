"""A slide in MuJoCo, pressed into the wall of the hardware's axis: with its force at 10 kHz it stands, at 1 kHz not."""

from dataclasses import replace

import matplotlib.pyplot as plt
import mujoco
import numpy as np

from hardwall.model import Sampler
from hardwall.sim.scene import spec

SLIDE = """<mujoco>
  <option timestep="1e-4" gravity="0 0 0"/>
  <worldbody><body><joint name="x" type="slide" axis="1 0 0"/><geom size="0.02" mass="0.35"/></body></worldbody>
  <actuator><motor joint="x"/></actuator>
</mujoco>"""


def press(force_hz: int) -> np.ndarray:
    """Press the slide with 1 N into a wall of 50 kN/m and 50 N s/m for half a second; return its positions, um."""
    model = mujoco.MjModel.from_xml_string(SLIDE)
    data = mujoco.MjData(model)
    data.qpos[0], data.qvel[0] = -1e-3, 0.05
    wall = Sampler(replace(spec("seed-2011"), actuation_hz=force_hz), wall_stiffness=50e3, wall_damping=50.0)
    position = np.zeros(5000)
    for k in range(len(position)):
        position[k] = data.qpos[0]
        data.ctrl[0] = 1.0 + wall(data.qpos[0])
        mujoco.mj_step(model, data)
    return 1e6 * position


plt.figure(figsize=(7.0, 4.0))
for force_hz in (10_000, 1_000):
    position = press(force_hz)
    print(f"force at {force_hz} Hz: the last 0.1 s swing by {np.ptp(position[-1000:]):.1f} um")
    plt.plot(np.arange(5000) / 10, position, label=f"force at {force_hz / 1000:g} kHz")
plt.gca().set(xlabel="time, ms", ylabel="position, µm; the wall begins at 0", ylim=(-250, 250))
plt.legend()
plt.savefig("slide.png", dpi=150)
