"""Accelerations of a chain of four joints, one a ball joint, and their derivatives against Pinocchio's (K4b)."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import torch
from pinocchio_tables import CHAIN, STATES
from scipy.spatial.transform import Rotation

import magshell as ms

STEPS = (3.2e-2, 1.6e-2, 8e-3, 4e-3, 2e-3)  # s, extrapolated to zero
CLOSE = 1e-6  # of the largest entry
DIFFERENCED = 3e-6  # of the largest entry; differences over 0.04 of accelerations that are known to 1e-8


class Posed:
    """The chain in a pose that is its rest shape. tilt: change of the coordinates, applied on the right."""

    def __init__(self, pose, rates, torques, tilt=(0.0,) * 6):
        self.links, self.joints, self.turns = [], [], []
        frame, origin, at, place = np.eye(3), np.zeros(3), 0, 0
        for kind, axis, placement, offset, mass, sides, com in CHAIN:
            origin, before = origin + frame @ offset, frame @ np.array(placement)
            own = slice(place, place + (3 if kind == "ball" else 1))
            axis = before @ np.array(axis)
            if kind == "ball":
                turn = Rotation.from_quat(pose[at : at + 4]) * Rotation.from_rotvec(list(tilt[own]))
                frame = before @ turn.as_matrix()
            else:
                along = (pose[at] + tilt[place]) * axis
                frame = Rotation.from_rotvec(along).as_matrix() @ before if kind == "revolute" else before
                origin = origin + along if kind == "prismatic" else origin
            at, place = at + (4 if kind == "ball" else 1), own.stop
            squares = np.square(sides)
            box = frame @ (mass / 12 * np.diag(squares.sum() - squares)) @ frame.T
            link = ms.Link(mass=mass, inertia=box, center=origin + frame @ com)
            ends = {"child": link, "parent": self.links[-1] if self.links else None, "origin": origin}
            if kind == "ball":
                joint = ms.Ball(**ends, rate=frame @ rates[own], torque=frame @ torques[own])
            elif kind == "revolute":
                joint = ms.Revolute(**ends, axis=axis, rate=rates[place - 1], torque=torques[place - 1])
            else:
                joint = ms.Prismatic(**ends, axis=axis, rate=rates[place - 1], force=torques[place - 1])
            self.links.append(link)
            self.joints.append(joint)
            self.turns.append(frame)
        self.scene = ms.Scene(ms.Skeleton(self.links, self.joints), gravity=(0, 0, -9.81))

    def accelerations(self, values=None):
        """Compute the accelerations (6,), those of ball joints in the child's frame; tensors where the values are."""
        found = []
        for time_step in STEPS:
            move = ms.simulate(
                self.scene,
                steps=1,
                time_step=time_step,
                solver=ms.MixedNewton(tolerance=1e-13),
                values=values,
            )
            found.append(sum(self._change(move)) / time_step)
        for order in (1, 2, 3, 4):
            found = [(2**order * fine - rough) / (2**order - 1) for rough, fine in pairwise(found)]
        return found[0]

    def _change(self, move):
        """Yield the change of each joint's rates over the step, placed among all six."""
        place = 0
        for joint, link, turn in zip(self.joints, self.links, self.turns, strict=True):
            rate, turned = move[joint].rate, move[link].rotation
            if joint._kind == "ball":
                turn = turn if isinstance(rate, np.ndarray) else torch.tensor(turn)
                change = turn.T @ (turned[1].T @ rate[1] - turned[0].T @ rate[0])
            else:
                change = rate[1:] - rate[:1]
            before, after = np.zeros(place), np.zeros(6 - place - len(change))
            yield (
                np.concatenate([before, change, after])
                if isinstance(change, np.ndarray)
                else torch.cat([torch.tensor(before), change, torch.tensor(after)])
            )
            place += len(change)


@pytest.mark.parametrize("state", STATES, ids=["first", "second"])
def test_accelerations_and_their_derivatives_are_those_of_pinocchio(state):
    pose, rates, torques, accelerations, _, by_pose = map(np.array, state[:6])
    posed = Posed(pose, rates, torques)
    found = posed.accelerations()
    np.testing.assert_allclose(found, accelerations, atol=1e-7 * np.abs(accelerations).max())

    tilts = np.zeros((6, 6))
    for k in range(6):
        unit = np.eye(6)[k]
        for weight, steps in ((8 / 12, 1), (-1 / 12, 2)):
            there, back = (
                Posed(pose, rates, torques, sign * steps * 4e-2 * unit).accelerations() for sign in (1, -1)
            )
            tilts[:, k] += weight * (there - back) / 4e-2
    np.testing.assert_allclose(tilts, by_pose, atol=DIFFERENCED * np.abs(by_pose).max())


@pytest.mark.parametrize("state", STATES, ids=["first", "second"])
def test_gradients_of_accelerations_are_those_of_pinocchio(state):
    """Check the adjoint of one step, extrapolated to a step of zero."""
    pose, rates, torques, _, _, _, by_rates, by_torques = map(np.array, state)
    posed = Posed(pose, rates, torques)
    for kind, wanted in (("rate", by_rates), ("torque", by_torques)):
        values, leaves = {}, []
        for joint in posed.joints:
            name = "force" if kind == "torque" and joint._kind == "prismatic" else kind
            leaves.append(torch.tensor(getattr(joint, name), dtype=torch.float64, requires_grad=True))
            values[joint] = {name: leaves[-1]}
        accelerations = posed.accelerations(values)
        rows = []
        for each in accelerations:
            by_leaves = torch.autograd.grad(each, leaves, retain_graph=True)
            row = [
                turn.T @ by.numpy() if by.ndim else by.numpy()[None]
                for by, turn in zip(by_leaves, posed.turns, strict=True)
            ]
            rows.append(np.concatenate(row))
        np.testing.assert_allclose(np.array(rows), wanted, atol=CLOSE * np.abs(wanted).max())
