"""Skeletons from URDF files: an arm against the same made by hand, and refused files."""

from __future__ import annotations

import numpy as np
import pytest

import magshell as ms

pytest.importorskip("yourdfpy", reason="reading URDF is the extra urdf")

ARM = """<robot name="arm">
  <link name="base"/>
  <link name="upper">
    <inertial>
      <origin xyz="0.25 0 0" rpy="0 0 0.5"/>
      <mass value="2.0"/>
      <inertia ixx="0.01" iyy="0.05" izz="0.06" ixy="0.002" ixz="0" iyz="0"/>
    </inertial>
  </link>
  <link name="lower">
    <inertial>
      <origin xyz="0.2 0 0"/>
      <mass value="1.0"/>
      <inertia ixx="0.002" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
  <link name="tool"><inertial><mass value="0.3"/></inertial></link>
  <joint name="shoulder" type="continuous">
    <parent link="base"/><child link="upper"/>
    <origin xyz="0 0 1" rpy="0 0 0.3"/><axis xyz="0 1 0"/>
    <dynamics damping="0.4"/>
  </joint>
  <joint name="elbow" type="revolute">
    <parent link="upper"/><child link="lower"/>
    <origin xyz="0.5 0 0" rpy="0 0.2 0"/><axis xyz="0 0 1"/>
    <limit lower="-0.1" upper="0.7" effort="10" velocity="5"/>
  </joint>
  <joint name="wrist" type="fixed">
    <parent link="lower"/><child link="tool"/><origin xyz="0.4 0 0"/>
  </joint>
</robot>"""
LIMIT = {"limit_stiffness": 1e3, "limit_smoothing": 1e-2}


def written(tmp_path, text: str):
    path = tmp_path / "robot.urdf"
    path.write_text(text)
    return path


def rotation(axis: int, angle: float) -> np.ndarray:
    a, b = (axis + 1) % 3, (axis + 2) % 3
    turn = np.eye(3)
    turn[[a, b], [a, b]] = np.cos(angle)
    turn[a, b], turn[b, a] = -np.sin(angle), np.sin(angle)
    return turn


def test_an_arm_moves_as_the_same_made_by_hand(tmp_path):
    read = ms.Skeleton.from_urdf(written(tmp_path, ARM), **LIMIT)
    first = rotation(2, 0.3)
    second = first @ rotation(1, 0.2)
    top, bend = np.array([0, 0, 1.0]), np.array([0, 0, 1.0]) + first @ [0.5, 0, 0]
    own = first @ rotation(2, 0.5)
    inertia = np.array([[0.01, 0.002, 0], [0.002, 0.05, 0], [0, 0, 0.06]])
    upper = ms.Link(mass=2.0, inertia=own @ inertia @ own.T, center=top + first @ [0.25, 0, 0])
    lower = ms.Link(
        mass=1.0, inertia=second @ np.diag([0.002, 0.02, 0.02]) @ second.T, center=bend + second @ [0.2, 0, 0]
    )
    tool = ms.Link(mass=0.3, center=bend + second @ [0.4, 0, 0])
    joints = [
        ms.Revolute(upper, origin=top, axis=first @ [0, 1, 0], damping=0.4),
        ms.Revolute(
            lower, upper, origin=bend, axis=second @ [0, 0, 1], lower_limit=-0.1, upper_limit=0.7, **LIMIT
        ),
        ms.Fixed(tool, lower),
    ]
    by_hand = ms.Skeleton([upper, lower, tool], joints)
    tips = []
    for skeleton, end in ((read, read.named["tool"]), (by_hand, tool)):
        scene = ms.Scene(skeleton, gravity=(0, 0, -9.81))
        tips.append(ms.simulate(scene, steps=40, time_step=1e-2)[end].center)
    assert np.abs(tips[0] - tips[0][0]).max() > 0.1
    np.testing.assert_allclose(*tips, atol=1e-10)
    assert read.named["elbow"].upper_limit == 0.7 and read.named["shoulder"].damping == 0.4


def test_a_free_base_falls(tmp_path):
    with pytest.raises(ValueError, match=r"root 'base'.*no mass"):
        ms.Skeleton.from_urdf(written(tmp_path, ARM), fixed_base=False, limits=False)
    heavy = '<link name="base"><inertial><mass value="1"/><inertia ixx="1e-2" iyy="1e-2" izz="1e-2" '
    heavy += 'ixy="0" ixz="0" iyz="0"/></inertial></link>'
    path = written(tmp_path, ARM.replace('<link name="base"/>', heavy))
    robot = ms.Skeleton.from_urdf(path, fixed_base=False, limits=False)
    scene = ms.Scene(robot, gravity=(0, 0, -9.81), allow_rigid_motions=True)
    upper = robot.named["upper"]
    heights = ms.simulate(scene, steps=10, time_step=1e-2)[upper].center[:, 2]
    assert heights[-1] - heights[0] == pytest.approx(-0.5 * 9.81 * 0.1**2, rel=1e-6)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("<limit", '<mimic joint="shoulder"/><limit', r"'elbow'.*mimics"),
        ('damping="0.4"', 'damping="0.4" friction="0.1"', r"'shoulder'.*friction"),
        ('type="continuous"', 'type="planar"', r"'shoulder'.*'planar'"),
        ('<child link="tool"/>', '<child link="lower"/>', "two joints lead to link 'lower'"),
        ('<child link="tool"/>', '<child link="hand"/>', "'hand', is not a link"),
        ('<link name="base"/>', '<link name="base"/><link name="stray"/>', "one root"),
        ('<parent link="base"/>', '<parent link="tool"/>', r"one root|loop"),
        ('ixx="0.01"', 'ixx="1.0"', r"'upper'.*inertia"),
        ('<axis xyz="0 1 0"/>', '<axis xyz="0 0 0"/>', r"'shoulder'.*axis must not be zero"),
        ("</robot>", "", "not a URDF file"),
        ('<joint name="wrist"', '<joint name="elbow"', "several joints of one name: elbow"),
        ('<link name="base"/>', '<link name="base"/><link name="tool"/>', "several links of one name: tool"),
        ('lower="-0.1" upper="0.7"', "", r"'elbow'.*limits are 0 and 0"),
    ],
)
def test_unsupported_elements_are_refused(tmp_path, old, new, message):
    assert old in ARM
    with pytest.raises(ValueError, match=message):
        ms.Skeleton.from_urdf(written(tmp_path, ARM.replace(old, new)), **LIMIT)


def test_limits_are_not_dropped_in_silence(tmp_path):
    path = written(tmp_path, ARM)
    with pytest.raises(ValueError, match=r"'elbow'.*limit_stiffness"):
        ms.Skeleton.from_urdf(path)
    assert ms.Skeleton.from_urdf(path, limits=False).named["elbow"].upper_limit is None
    one_sided = written(tmp_path, ARM.replace('lower="-0.1"', ""))
    assert ms.Skeleton.from_urdf(one_sided, **LIMIT).named["elbow"].lower_limit == 0.0  # as URDF defines it
    with pytest.raises(FileNotFoundError, match="no file"):
        ms.Skeleton.from_urdf(tmp_path / "nothing.urdf")
