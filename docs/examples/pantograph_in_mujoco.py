"""A pantograph in MuJoCo, its tip pressed into the wall of the hardware's axis: at 10 kHz it stands, at 1 kHz not."""

from dataclasses import replace

import matplotlib.pyplot as plt
import mujoco
import numpy as np

from hardwall.model import Sampler
from hardwall.sim.scene import spec

# Both motors are at the base: the second one turns the fore arm against it.
PANTOGRAPH = """<mujoco>
  <option timestep="1e-4" gravity="0 0 0"/>
  <default><geom type="capsule" size="0.006" contype="0" conaffinity="0"/><joint axis="0 0 1"/></default>
  <worldbody><body><joint name="upper"/><geom fromto="0 0 0 0.1 0.1 0"/>
    <body pos="0.1 0.1 0"><joint name="elbow"/><geom fromto="0 0 0 -0.1 0.1 0"/><site name="tip" pos="-0.1 0.1 0"/>
      <geom type="sphere" pos="-0.1 0.1 0" size="0.02" mass="0.3"/></body></body></worldbody>
  <tendon><fixed name="fore"><joint joint="upper" coef="1"/><joint joint="elbow" coef="1"/></fixed></tendon>
  <actuator><motor joint="upper"/><motor tendon="fore"/></actuator>
</mujoco>"""


def press(force_hz: int) -> np.ndarray:
    """Press the tip with 1 N into a wall of 50 kN/m and 50 N s/m for half a second; return its depth, um."""
    model = mujoco.MjModel.from_xml_string(PANTOGRAPH)
    data, jacobian = mujoco.MjData(model), np.zeros((3, model.nv))
    wall = Sampler(replace(spec("seed-2011"), actuation_hz=force_hz), wall_stiffness=50e3, wall_damping=50.0)
    depth = np.zeros(5000)
    for k in range(len(depth)):
        mujoco.mj_step1(model, data)
        depth[k] = data.site("tip").xpos[1] - 0.201
        mujoco.mj_jacSite(model, data, jacobian, None, 0)
        upper, elbow = jacobian[1] * (1.0 + wall(depth[k]))
        data.ctrl[:] = upper - elbow, elbow
        mujoco.mj_step2(model, data)
    return 1e6 * depth


plt.figure(figsize=(7.0, 4.0))
for force_hz in (10_000, 1_000):
    depth = press(force_hz)
    print(f"force at {force_hz} Hz: the last 0.1 s swing by {np.ptp(depth[-1000:]):.1f} um")
    plt.plot(np.arange(5000) / 10, depth, label=f"force at {force_hz / 1000:g} kHz")
plt.gca().set(xlabel="time, ms", ylabel="depth of the tip, µm; the wall begins at 0", ylim=(-250, 250))
plt.legend()
plt.savefig("pantograph.png", dpi=150)
