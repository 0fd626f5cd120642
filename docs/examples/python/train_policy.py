"""Trains a policy to insert a peg, with and without force:  train_policy.py [--generations N]

The hole is observed up to 1 mm beside its place, with 0.2 mm of room: a policy that feels can find it, one that only sees cannot.
The policy is linear, and trained by the cross-entropy method: the best of a generation are the mean of the next.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np

import peg_parts
import touchstone as ts

POPULATION, ELITE, EPISODES = 24, 6, 6
SCALE = np.array([1, 1, 1, 5, 5, 5, 20, 20, 20, 1.0])  # of what a policy sees: mm, N, mN·m, 1


def features(observation, felt):
    """What a policy sees (n, 10): the way to the goal as observed, force and torque, and 1."""
    way = observation["goal"][:, :3] - observation["pose"][:, :3]
    return np.hstack([way, observation["wrench"] * felt, np.ones((len(way), 1))]) / SCALE


def rollout(task, policies, seeds, felt):
    """One episode of each policy (n, 3, 10). Returns the rewards and what was seated, (n,)."""
    observation = task.reset(seeds)
    reward, seated, over = np.zeros(len(task)), np.zeros(len(task), bool), np.zeros(len(task), bool)
    while not over.all():
        actions = np.zeros((len(task), 6))
        actions[:, :3] = np.tanh(np.einsum("nij,nj->ni", policies, features(observation, felt))) * task.step[:3]
        observation, gained, terminated, truncated, _ = task.act(actions)
        reward += np.where(over, 0, gained)
        seated |= terminated & ~over
        over |= terminated | truncated
    return reward, seated


def train(task, felt, generations, seed):
    random = np.random.default_rng(seed)
    mean, spread = np.zeros((3, 10)), np.ones((3, 10))
    mean[[0, 1, 2], [0, 1, 2]] = 1  # toward the goal
    for generation in range(generations):
        candidates = mean + spread * random.normal(size=(POPULATION, 3, 10))
        # All meet the same episodes, which change with the generation.
        seeds = np.tile(np.arange(EPISODES) + EPISODES * generation, POPULATION)
        reward, seated = rollout(task, np.repeat(candidates, EPISODES, axis=0), seeds, felt)
        order = np.argsort(-reward.reshape(POPULATION, EPISODES).mean(axis=1))[:ELITE]
        mean, spread = candidates[order].mean(axis=0), candidates[order].std(axis=0) + 0.05
        print(f"  generation {generation + 1}: {100 * seated.mean():.0f} % seated, reward {reward.mean():.2f}", flush=True)
    return mean


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--generations", type=int, default=12)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        task = ts.InsertionBatch(
            peg_parts.write(Path(folder) / "peg.glb"), POPULATION * EPISODES,
            start_error_mm=0.3, goal_error_mm=1.0, step_mm=0.3, max_actions=150,
        )
        share = {}
        for felt in (True, False):
            print("with force" if felt else "without force")
            policy = train(task, felt, options.generations, options.seed)
            unseen = 10**6 + np.arange(len(task))
            _, seated = rollout(task, np.tile(policy, (len(task), 1, 1)), unseen, felt)
            share[felt] = seated.mean()
    print(f"seated of {len(task)} unseen episodes: {100 * share[True]:.0f} % with force, {100 * share[False]:.0f} % without")


if __name__ == "__main__":
    main()
