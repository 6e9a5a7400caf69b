/* What the world does to a voxel, and how it moves. physics.md 6 */
#ifndef SV_VOXEL_H
#define SV_VOXEL_H

#include "block.h"

/* Force and moment on voxel `v` from its links. */
SV_INLINE void gather(const block *b, int32_t v, v3 *force, v3 *moment)
{
    const sv_joints *joints = &b->body.joints[v];
    v3 f = zero3(), m = zero3();
    int32_t i = 0;
    for (; i < joints->as_a; i++) {
        const link_effect *e = &b->effect[joints->link[i]];
        f = add3(f, e->force);
        m = sub3(m, e->moment_a);
    }
    for (; i < joints->as_a + joints->as_b; i++) {
        const link_effect *e = &b->effect[joints->link[i]];
        f = sub3(f, e->force);
        m = sub3(m, e->moment_b);
    }
    *force = f;
    *moment = m;
}

/* The floor on a voxel sunk into it by `depth`: normal force, damping, Coulomb friction and interfacial
 * shear. physics.md 6.2, with N mu replaced by N mu + tau s^2 (Majidi et al. 2013). */
SV_INLINE void floor_contact(const coefficients *k, vm touching, vf depth, vf edge, v3 *force, v3 *velocity)
{
    vf normal = depth * k->floor_stiffness, shear = k->shear_strength * (edge * edge);
    vf fz = force->z + (normal - k->floor_damper * velocity->z);
    vf push_squared = force->x * force->x + force->y * force->y;
    vf speed_squared = velocity->x * velocity->x + velocity->y * velocity->y;

    vm standing = le(vabs(velocity->x) + vabs(velocity->y), all(0)) & touching;
    vf grip = k->friction_static * normal + shear;
    vm held = standing & lt(push_squared, grip * grip);

    vm sliding = touching & ~standing;
    vf brake = k->friction_kinetic * normal + shear;
    vf speed = vsqrt(speed_squared);
    vm slides_on = sliding & lt(brake, k->mass_over_dt * speed);
    vm stops = sliding & ~slides_on;
    vf per_speed = brake / select(slides_on, speed, all(1));

    vm still = held | stops;
    force->x = select(still, all(0), select(slides_on, force->x - per_speed * velocity->x, force->x));
    force->y = select(still, all(0), select(slides_on, force->y - per_speed * velocity->y, force->y));
    force->z = select(touching, fz, force->z);
    velocity->x = select(stops, all(0), velocity->x);
    velocity->y = select(stops, all(0), velocity->y);
}

/* q brought back to unit length, for |q|^2 = 1 + excess. A step changes it so little that a short series
 * is exact to the last bit; past its reach, the square root. */
SV_INLINE vf unit_factor(vf square)
{
    vf e = square - 1.0;
    vf factor = 1.0 - e * (0.5 - e * (0.375 - e * (0.3125 - e * 0.2734375)));
    vm far = gt(vabs(e), all(2e-4));
    if (any(far))
        factor = select(far, 1.0 / vsqrt(square), factor);
    return factor;
}

/* q += dt/2 (0, spin) q, normalised. physics.md 6.5 */
SV_INLINE quat turned(quat q, v3 spin, vf half_dt)
{
    v3 h = scale3(half_dt, spin);
    quat next = {q.w - dot3(h, q.v),
                 {q.v.x + (h.x * q.w + h.y * q.v.z - h.z * q.v.y), q.v.y + (h.y * q.w + h.z * q.v.x - h.x * q.v.z),
                  q.v.z + (h.z * q.w + h.x * q.v.y - h.y * q.v.x)}};
    vf factor = unit_factor(next.w * next.w + dot3(next.v, next.v));
    next.w = next.w * factor;
    next.v = scale3(factor, next.v);
    return select_quat(ge(next.w, all(1)), (quat){all(1), zero3()}, next);
}

/* The edge that the pump asks of a voxel. A swing of 0 is a voxel that is passive or not yet actuated:
 * it rests; one that is not finite must show. physics.md 6.6 */
SV_INLINE vf pumped_edge(vf edge, vf strain, vf sine, const sv_batch *batch)
{
    const vf rest = all(batch->edge), swing = rest * (strain * sine);
    const vf target = select(le(vabs(swing), all(0)), rest, batch->pumped_rest + swing);
    if (batch->actuation == SV_HOLD)
        return select(lt(target, rest) & lt(target, edge), edge, target);
    if (batch->actuation == SV_CLAMP)
        return select(le(target, rest), rest, target);
    return target;
}

SV_INLINE void voxel_step(block *b, int32_t v)
{
    const coefficients *k = &b->k;
    voxel *x = &b->voxels[v];
    v3 force, moment;
    gather(b, v, &force, &moment);
    if (b->hits.count)
        force = add3(force, b->hits.push[v]);
    force = add3(sub3(force, scale3(k->drag, x->velocity)), k->weight);

    v3 velocity = x->velocity;
    vf depth = 0.5 * x->edge - x->place.z;
    vm touching = gt(depth, all(0));
    if (any(touching))
        floor_contact(k, touching, depth, x->edge, &force, &velocity);

    x->velocity = add3(velocity, scale3(k->dt_over_mass, force));
    x->place = add3(x->place, scale3(k->dt, x->velocity));
    x->spin = scale3(k->spin_keep, add3(x->spin, scale3(k->dt_over_inertia, moment)));
    x->turn = turned(x->turn, x->spin, k->half_dt);
    x->axes = matrix_of(x->turn);
    const pump *p = &b->pumps[b->pump_count > 1 ? v : 0];
    x->edge = pumped_edge(x->edge, x->strain, p->sine, b->batch);
}

#endif
