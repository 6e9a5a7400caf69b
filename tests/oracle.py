"""docs/physics.md written once more, for one design, with none of the engine's shortcuts.

Plain Python: quaternion products, the C library's sine and arc cosine, every formula as it stands.
It is slow and easy to compare with the page.
"""

from __future__ import annotations

from itertools import combinations
from math import acos, cos, floor, pi, sin, sqrt

import numpy as np

THETA = 0.01732


def product(a, b):
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return np.array(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ]
    )


def conjugate(q):
    return q * [1, -1, -1, -1]


def rotate(q, v):
    return product(product(q, np.array([0, *v])), conjugate(q))[1:]


def rotation_vector(q):
    w, rest = q[0], 1 - q[0] ** 2
    if rest <= 0:
        return np.zeros(3)
    if rest < 1 - 0.9988**2:
        return q[1:] * 2 * sqrt((2 - 2 * w) / rest)
    return q[1:] * 2 * acos(min(w, 1)) / sqrt(rest)


def tilt(u):
    x, y, z = u
    if x > 0 and abs(y / x) < THETA and abs(z / x) < THETA:
        ky, kz = z / x / 2, -y / x / 2
        return np.array([1 - (ky**2 + kz**2) / 2, 0, ky, kz])
    x, y, z = u / np.linalg.norm(u)
    aside = sqrt(y**2 + z**2)
    if aside == 0:
        return np.array([0.0, 0, 1, 0])
    half = acos(x) / 2
    return np.array([cos(half), 0, z / aside * sin(half), -y / aside * sin(half)])


def into_link(axis, v):
    x, y, z = v
    return np.array([(x, y, z), (y, -x, z), (z, y, -x)][axis])


def out_of_link(axis, v):
    x, y, z = v
    return np.array([(x, y, z), (-y, x, z), (-z, y, x)][axis])


class Link:
    def __init__(self, a, b, axis):
        self.a, self.b, self.axis, self.large = a, b, axis, False
        self.before = np.zeros((3, 3))

    def switch(self, u, n, rest):
        turn, stretch = (abs(u[1]) + abs(u[2])) / u[0], u[0] / rest
        was = self.large
        if was:
            self.large = not (n[0] > cos(THETA / 2) and turn < 0.05 and stretch < 1.3)
        else:
            self.large = n[0] <= cos(1.1 * THETA / 2) or turn > 0.055 or stretch > 1.43
        return was != self.large

    def effect(self, run):
        """Force on a, and the moments, in the world."""
        k, place, turn, edge = run, run.place, run.turn, run.edge
        qa, qb = ([q[0], *into_link(self.axis, q[1:])] for q in (turn[self.a], turn[self.b]))
        qa, qb = np.array(qa), np.array(qb)
        r = into_link(self.axis, place[self.b] - place[self.a])
        u, n = rotate(conjugate(qa), r), product(conjugate(qa), qb)
        rest = (edge[self.a] + edge[self.b]) / 2
        changed = self.switch(u, n, rest)
        if self.large:
            lay = tilt(u)
            back = product(lay, conjugate(qa))
            d = np.array([np.linalg.norm(r) - rest, 0, 0])
            p1, p2 = rotation_vector(lay), rotation_vector(product(lay, n))
        else:
            back, d = conjugate(qa), u - [rest, 0, 0]
            p1, p2 = np.zeros(3), rotation_vector(n)
        force, m1, m2 = beam((k.a1, k.a2, k.b1, k.b2, k.b3), d, p1, p2)
        if not changed:
            now = np.array([d, p1, p2])
            rates = (now - self.before) / k.dt
            damping = beam((k.c_a1, k.c_a2, k.c_b1, k.c_b2, k.c_b3), *rates)
            force = force + k.zeta_link / 2 * damping[0]
            m1, m2 = m1 + k.zeta_link / 4 * damping[1], m2 + k.zeta_link / 4 * damping[2]
            self.before = now
        self.tension = force[0]
        return [out_of_link(self.axis, rotate(conjugate(back), v)) for v in (force, m1, m2)]


def beam(stiffness, d, p1, p2):
    a1, a2, b1, b2, b3 = stiffness
    s = p1 + p2
    force = np.array([a1 * d[0], b1 * d[1] - b2 * s[2], b1 * d[2] + b2 * s[1]])
    moments = [
        np.array([a2 * twist, b2 * d[2] + b3 * (s[1] + own[1]), -b2 * d[1] + b3 * (s[2] + own[2])])
        for twist, own in ((p1[0] - p2[0], p1), (p2[0] - p1[0], p2))
    ]
    return force, *moments


class Run:
    """One design; strain has shape (cycles, nx, ny, nz), phase (nx, ny, nz)."""

    def __init__(self, digits, physics, strain, phase):
        self.physics, edge, young = physics, physics.edge, physics.youngs_modulus
        self.sites = [tuple(site) for site in np.argwhere(digits.transpose(2, 1, 0) > 0)[:, ::-1]]
        self.active = [digits[site] == 2 for site in self.sites]
        self.strain = [strain[(slice(None), *site)] for site in self.sites]
        self.phase = [phase[site] for site in self.sites]
        self.set_constants(edge, young)
        count = len(self.sites)
        self.place = (np.array(self.sites) + 0.5) * edge
        self.velocity, self.spin = np.zeros((count, 3)), np.zeros((count, 3))
        self.turn = np.tile([1.0, 0, 0, 0], (count, 1))
        self.edge = np.full(count, edge)
        self.find_links()
        self.pairs, self.travel = None, 0.0
        self.energy, self.edge_before = 0.0, self.edge.copy()

    def set_constants(self, edge, young):
        p = self.physics
        mass = p.density * edge**3
        inertia, first = mass * edge**2 / 6, mass * edge / 2
        shear = young / (2 * (1 + p.poisson_ratio))
        self.mass, self.inertia, self.dt, self.zeta_link = (
            mass,
            inertia,
            p.time_step,
            p.damping_link,
        )
        self.a1, self.a2, self.b1 = young * edge, shear * edge**3 / 6, young * edge
        self.b2, self.b3 = young * edge**2 / 2, young * edge**3 / 6
        self.c_a1, self.c_a2 = 2 * sqrt(self.a1 * mass), 2 * sqrt(self.a2 * inertia)
        self.c_b1, self.c_b2 = 2 * sqrt(self.b1 * mass), 2 * sqrt(self.b2 * first)
        self.c_b3 = 2 * sqrt(self.b3 * inertia)
        self.c_v, self.c_w = 2 * sqrt(mass * young * edge), 2 * sqrt(inertia * young * edge**3)

    def find_links(self):
        index = {site: i for i, site in enumerate(self.sites)}
        self.links = [
            Link(index[site], index[other], axis)
            for site in self.sites
            for axis in range(3)
            if (other := tuple(np.add(site, np.eye(3, dtype=int)[axis]))) in index
        ]
        count = len(self.sites)
        hops = np.full((count, count), np.inf)
        np.fill_diagonal(hops, 0)
        for link in self.links:
            hops[link.a, link.b] = hops[link.b, link.a] = 1
        surface = (hops == 1).sum(axis=1) < 6
        for middle in range(count):
            hops = np.minimum(hops, hops[:, middle, None] + hops[None, middle])
        self.may_collide = [
            (i, j)
            for i, j in combinations(range(count), 2)
            if surface[i] and surface[j] and hops[i, j] > 3
        ]

    def collisions(self):
        edge = self.physics.edge
        self.travel += np.linalg.norm(self.velocity, axis=1).max() * self.dt / edge
        if self.pairs is None or self.travel > 0.5:
            self.travel = 0.0
            self.pairs = [
                (i, j)
                for i, j in self.may_collide
                if (r := np.linalg.norm(self.place[j] - self.place[i])) < 3 * edge
                and r < 2 * self.edge[i]
            ]
        for i, j in self.pairs:
            r = self.place[j] - self.place[i]
            overlap = 0.75 * (self.edge[i] + self.edge[j]) - np.linalg.norm(r)
            if overlap > 0:
                yield i, j, self.a1 * overlap * r / np.linalg.norm(r)

    def floor(self, i, force):
        """Change the force on a voxel; return whether it stops."""
        p, speed = self.physics, np.linalg.norm(self.velocity[i, :2])
        depth = self.edge[i] / 2 - self.place[i, 2]
        if depth <= 0:
            return False
        normal = 2 * p.youngs_modulus * p.edge * depth
        shear = p.shear_strength * self.edge[i] ** 2
        force[2] += normal - p.damping_ground * self.c_v * self.velocity[i, 2]
        kinetic = p.friction_kinetic * normal + shear
        if speed == 0:
            if np.linalg.norm(force[:2]) < p.friction_static * normal + shear:
                force[:2] = 0
            return False
        if kinetic * self.dt < self.mass * speed:
            force[:2] -= kinetic * self.velocity[i, :2] / speed
            return False
        return True

    def pumped(self, i, t):
        p, edge = self.physics, self.edge[i]
        if not self.active[i] or t < p.settle_time:
            return p.edge
        turns = p.frequency_hz * t + self.phase[i]
        first = floor(p.frequency_hz * p.settle_time + self.phase[i] + 1e-3)
        cycle = min(max(floor(turns) - first, 0), len(self.strain[i]) - 1)
        target = p.pumped_rest + p.edge * self.strain[i][cycle] * sin(2 * pi * turns)
        if p.actuation == "hold":
            return edge if target < p.edge and target < edge else target
        return max(target, p.edge) if p.actuation == "clamp" else target

    def step(self, t):
        p, count = self.physics, len(self.sites)
        force, moment = np.zeros((count, 3)), np.zeros((count, 3))
        for link in self.links:
            f, m1, m2 = link.effect(self)
            force[link.a] += f
            force[link.b] -= f
            moment[link.a] -= m1
            moment[link.b] -= m2
        for i, j, push in self.collisions():
            force[i] -= push
            force[j] += push
        force += self.mass * p.gravity_vector - p.damping_global * self.c_v * self.velocity
        edge = self.edge.copy()
        for i in range(count):
            if self.floor(i, force[i]):
                self.velocity[i, :2] = force[i, :2] = 0
            self.velocity[i] += force[i] * self.dt / self.mass
            self.place[i] += self.velocity[i] * self.dt
            keep = 1 - 10 * p.damping_global * self.c_w * self.dt / self.inertia
            self.spin[i] = (self.spin[i] + moment[i] * self.dt / self.inertia) * keep
            q = self.turn[i] + self.dt / 2 * product(np.array([0, *self.spin[i]]), self.turn[i])
            q /= np.linalg.norm(q)
            self.turn[i] = [1.0, 0, 0, 0] if q[0] >= 1 else q
            self.edge[i] = self.pumped(i, t)
        for link in self.links:
            swelling = (self.edge - self.edge_before)[[link.a, link.b]].mean() / 2
            self.energy -= link.tension * swelling
        self.edge_before = edge

    def displacement(self):
        """Run to the end; return the displacement in voxel widths."""
        t, start = 0.0, None
        while True:
            if start is None and t > self.physics.settle_time:
                start = self.place.mean(axis=0)
            if t > self.physics.duration:
                return (self.place.mean(axis=0) - start) / self.physics.edge
            self.step(t)
            t += self.dt
