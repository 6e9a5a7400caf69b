/* What the world does to a voxel, and how it moves. physics.md 6 */
#pragma once

#include "pump.inl.h"

/* The floor on a voxel sunk into it by `depth`: normal force, damping, Coulomb friction and interfacial
 * shear. physics.md 6.2, with N mu replaced by N mu + tau s^2 (Majidi et al. 2013). */
SV_INLINE void sv_floor_contact(const sv_coefficients *k, sv_mask touching, sv_wide depth, sv_wide edge, sv_vec3 *force,
                                sv_vec3 *velocity)
{
    sv_wide normal = depth * k->floor_stiffness, shear = k->shear_strength * (edge * edge);
    sv_wide fz = force->z + (normal - k->floor_damper * velocity->z);
    sv_wide push_squared = force->x * force->x + force->y * force->y;
    sv_wide speed_squared = velocity->x * velocity->x + velocity->y * velocity->y;

    sv_mask standing = sv_le(sv_abs(velocity->x) + sv_abs(velocity->y), sv_splat(0)) & touching;
    sv_wide grip = k->friction_static * normal + shear;
    sv_mask held = standing & sv_lt(push_squared, grip * grip);

    sv_mask sliding = touching & ~standing;
    sv_wide brake = k->friction_kinetic * normal + shear;
    sv_wide speed = sv_sqrt(speed_squared);
    sv_mask slides_on = sliding & sv_lt(brake, k->mass_over_dt * speed);
    sv_mask stops = sliding & ~slides_on;
    sv_wide per_speed = brake / sv_select(slides_on, speed, sv_splat(1));

    sv_mask still = held | stops;
    force->x = sv_select(still, sv_splat(0), sv_select(slides_on, force->x - per_speed * velocity->x, force->x));
    force->y = sv_select(still, sv_splat(0), sv_select(slides_on, force->y - per_speed * velocity->y, force->y));
    force->z = sv_select(touching, fz, force->z);
    velocity->x = sv_select(stops, sv_splat(0), velocity->x);
    velocity->y = sv_select(stops, sv_splat(0), velocity->y);
}

/* q brought back to unit length, for |q|^2 = 1 + excess. A step changes it so little that a short series
 * is exact to the last bit; past its reach, the square root. */
SV_INLINE sv_wide sv_unit_factor(sv_wide square)
{
    sv_wide e = square - 1.0;
    sv_wide factor = 1.0 - e * (0.5 - e * (0.375 - e * (0.3125 - e * 0.2734375)));
    sv_mask far = sv_gt(sv_abs(e), sv_splat(2e-4));
    if (sv_any(far))
        factor = sv_select(far, 1.0 / sv_sqrt(square), factor);
    return factor;
}

/* q += dt/2 (0, spin) q, normalised. physics.md 6.5 */
SV_INLINE sv_quat sv_turn(sv_quat q, sv_vec3 spin, sv_wide half_dt)
{
    sv_vec3 h = sv_scale3(half_dt, spin);
    sv_quat next = {q.w - sv_dot3(h, q.v),
                    {q.v.x + (h.x * q.w + h.y * q.v.z - h.z * q.v.y), q.v.y + (h.y * q.w + h.z * q.v.x - h.x * q.v.z),
                     q.v.z + (h.z * q.w + h.x * q.v.y - h.y * q.v.x)}};
    sv_wide factor = sv_unit_factor(next.w * next.w + sv_dot3(next.v, next.v));
    next.w = next.w * factor;
    next.v = sv_scale3(factor, next.v);
    return sv_select_quat(sv_ge(next.w, sv_splat(1)), (sv_quat){sv_splat(1), sv_zero3()}, next);
}

/* The edge that the pump asks of a voxel. A swing of 0 is a voxel that is passive or not yet actuated:
 * it rests; one that is not finite must show. physics.md 6.6 */
SV_INLINE sv_wide sv_pumped_edge(sv_wide edge, sv_wide strain, sv_wide sine, const sv_batch *batch)
{
    const sv_wide rest = sv_splat(batch->edge), swing = rest * (strain * sine);
    const sv_wide target = sv_select(sv_le(sv_abs(swing), sv_splat(0)), rest, batch->pumped_rest + swing);
    if (batch->actuation == SV_HOLD)
        return sv_select(sv_lt(target, rest) & sv_lt(target, edge), edge, target);
    if (batch->actuation == SV_CLAMP)
        return sv_select(sv_le(target, rest), rest, target);
    return target;
}

/* What the pump does in this step to the links of a row of voxels, by the trapezoidal rule. physics.md 12 */
SV_INLINE void sv_meter_step(sv_meter *m, int32_t row, sv_wide tension, sv_wide edge, sv_wide next_edge)
{
    m->work[row] = m->work[row] - tension * (next_edge - m->edge_before[row]);
    m->edge_before[row] = edge;
}

/* Moves a row of voxels, given force, moment and tension from their links. */
SV_INLINE void sv_voxel_step(sv_block *b, int32_t row, sv_vec3 force, sv_vec3 moment, sv_wide tension)
{
    const sv_coefficients *k = &b->k;
    sv_voxel *x = &b->voxels[row];
    if (b->contacts.pushed[row]) {
        force = sv_add3(force, b->contacts.push[row]);
        b->contacts.push[row] = sv_zero3();
        b->contacts.pushed[row] = 0;
    }
    force = sv_add3(sv_sub3(force, sv_scale3(k->drag, x->velocity)), k->weight);

    sv_pose *pose = &x->pose;
    sv_vec3 velocity = x->velocity;
    sv_wide depth = 0.5 * pose->edge - pose->place.z;
    sv_mask touching = sv_gt(depth, sv_splat(0));
    if (sv_any(touching))
        sv_floor_contact(k, touching, depth, pose->edge, &force, &velocity);

    x->velocity = sv_add3(velocity, sv_scale3(k->dt_over_mass, force));
    pose->place = sv_add3(pose->place, sv_scale3(k->dt, x->velocity));
    x->spin = sv_scale3(k->spin_keep, sv_add3(x->spin, sv_scale3(k->dt_over_inertia, moment)));
    pose->turn = sv_turn(pose->turn, x->spin, k->half_dt);
    const sv_wide edge = sv_pumped_edge(pose->edge, x->strain, sv_driven(b, row, false), b->batch);
    if (b->meter.work)
        sv_meter_step(&b->meter, row, tension, pose->edge, edge);
    pose->edge = edge;
}
