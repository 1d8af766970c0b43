/* Minimum of a convex quadratic over the pressures of a domain. At most three facets hold it, with multipliers of 0 or
 * more (Nocedal and Wright, 2006, Numerical Optimization, ch. 16.1). Without one of them, the minimum on the others
 * lies beyond it. So the search begins without facets and adds one that was passed, as the dual method of Goldfarb and
 * Idnani (1983), Math. Program. 27, 1, does; where that ends in no minimum, it exchanges the last facet. */
#ifndef RM_POLYTOPE_H
#define RM_POLYTOPE_H

#include "vector.h"

/* Facets 0 to 2: a chamber without pressure; 3 to 5: with its largest; 6: the largest sum; 7 to 9: the most of a
 * chamber and a share of the two others. */
#define RM_FACETS 10
/* Violation of a bound or of a multiplier's sign that is rounding. */
#define RM_ROUNDING (R(32.0) * RM_EPSILON)
/* Square of the sine below which facets count as parallel. */
#define RM_PARALLEL (R(64.0) * RM_EPSILON)

/* Domain of pressures in units of the largest one: normal.x <= bound for each facet. */
typedef struct {
    vec normal[RM_FACETS];
    rm_real bound[RM_FACETS];
    int count; /* without the last three where no such limit is known */
} polytope;

/* Facets that hold a point: for the first `size` of the axes, normal_i.axis_j = (i == j); the rest are free directions
 * along all of them, orthonormal. */
typedef struct {
    vec axes[3];
    int size;
} held_facets;

static void set_polytope(const rm_domain *domain, rm_real largest_pressure, polytope *box)
{
    const vec unit[3] = {{R(1.0), R(0.0), R(0.0)}, {R(0.0), R(1.0), R(0.0)}, {R(0.0), R(0.0), R(1.0)}};
    const vec all = {R(1.0), R(1.0), R(1.0)};
    const rm_real share = domain->beside_share, most = domain->beside_max;
    box->count = most > R(0.0) ? RM_FACETS : RM_FACETS - 3;
    box->normal[6] = all;
    box->bound[6] = domain->pressure_sum_max / largest_pressure;
    for (int k = 0; k < 3; k++) {
        box->normal[k] = scale(R(-1.0), unit[k]);
        box->bound[k] = R(0.0);
        box->normal[3 + k] = unit[k];
        box->bound[3 + k] = domain->pressure_max[k] / largest_pressure;
        box->normal[7 + k] = along(scale(share, all), R(1.0) - share, unit[k]);
        box->bound[7 + k] = most / largest_pressure;
    }
}

/* Put a point of pressures inside: each below its largest, then all closer to none. Facets of more than one pressure
 * are kept off by more than the rounding of other units. */
static vec within(vec point, const polytope *box)
{
    const vec at = {smaller(larger(point.x, R(0.0)), box->bound[3]), smaller(larger(point.y, R(0.0)), box->bound[4]),
                    smaller(larger(point.z, R(0.0)), box->bound[5])};
    rm_real part = R(1.0);
    for (int n = 6; n < box->count; n++) {
        const rm_real reach = dot(box->normal[n], at) * (R(1.0) + R(8.0) * RM_EPSILON);
        part = part * reach > box->bound[n] ? box->bound[n] / reach : part;
    }
    return part < R(1.0) ? scale(part, at) : at;
}

/* Return whether facets with these normals have a point in common, and set their axes. */
static int hold(const vec *normals, int size, held_facets *held)
{
    vec *axes = held->axes;
    held->size = size;
    if (size == 0) {
        const vec unit[3] = {{R(1.0), R(0.0), R(0.0)}, {R(0.0), R(1.0), R(0.0)}, {R(0.0), R(0.0), R(1.0)}};
        memcpy(axes, unit, sizeof unit);
        return 1;
    }
    const vec n = normals[0];
    const rm_real square = dot(n, n);
    if (size == 1) {
        const rm_real x = rm_abs(n.x), y = rm_abs(n.y), z = rm_abs(n.z);
        const int smallest = x <= y ? (x <= z ? 0 : 2) : (y <= z ? 1 : 2);
        const vec across = {(rm_real)(smallest == 0), (rm_real)(smallest == 1), (rm_real)(smallest == 2)};
        const vec first = cross(n, across), second = cross(n, first);
        axes[0] = scale(R(1.0) / square, n);
        axes[1] = scale(R(1.0) / rm_sqrt(dot(first, first)), first);
        axes[2] = scale(R(1.0) / rm_sqrt(dot(second, second)), second);
        return 1;
    }
    const vec m = normals[1], edge = cross(n, m);
    const rm_real area = dot(edge, edge), squares = square * dot(m, m);
    if (!(area > RM_PARALLEL * squares)) {
        return 0;
    }
    if (size == 2) {
        axes[0] = scale(R(1.0) / area, cross(m, edge));
        axes[1] = scale(R(1.0) / area, cross(edge, n));
        axes[2] = scale(R(1.0) / rm_sqrt(area), edge);
        return 1;
    }
    const vec l = normals[2];
    const rm_real volume = dot(edge, l);
    axes[0] = scale(R(1.0) / volume, cross(m, l));
    axes[1] = scale(R(1.0) / volume, cross(l, n));
    axes[2] = scale(R(1.0) / volume, edge);
    return volume * volume > RM_PARALLEL * squares * dot(l, l);
}

/* Return the least point on the held facets, from which the distances to them are `left`. */
static vec minimum_on(const held_facets *held, sym h, vec gradient, const rm_real *left)
{
    const vec *axes = held->axes, *free = axes + held->size;
    const int count = 3 - held->size;
    const rm_real least = RM_EPSILON * (h.xx + h.yy + h.zz);
    vec d = no_vec(), turned[3];
    rm_real m[3][3], y[3];
    for (int i = 0; i < held->size; i++) {
        d = along(d, left[i], axes[i]);
    }
    const vec slope = add(gradient, sym_apply(h, d));
    for (int i = 0; i < count; i++) {
        turned[i] = sym_apply(h, free[i]);
        y[i] = -dot(free[i], slope);
        for (int j = 0; j <= i; j++) {
            m[i][j] = dot(free[i], turned[j]);
        }
    }
    /* Cholesky's factorisation, without square roots. */
    for (int k = 0; k < count; k++) {
        m[k][k] = larger(m[k][k], least);
        for (int i = k + 1; i < count; i++) {
            const rm_real factor = m[i][k] / m[k][k];
            y[i] -= factor * y[k];
            for (int j = k + 1; j <= i; j++) {
                m[i][j] -= factor * m[j][k];
            }
        }
    }
    for (int k = count - 1; k >= 0; k--) {
        for (int i = k + 1; i < count; i++) {
            y[k] -= m[i][k] * y[i];
        }
        y[k] /= m[k][k];
        d = along(d, y[k], free[k]);
    }
    return d;
}

/* Minimise d.H d/2 + g.d over the polytope, or its face where chamber `without` has no pressure (-1: all of it), with d
 * from `point` and H positive definite. Return the point of the minimum, inside without rounding. */
static vec minimum_over(sym h, vec gradient, vec point, const polytope *box, int without)
{
    const int on_face = without >= 0, most = 3 - on_face;
    const rm_real unit = h.xx + h.yy + h.zz + largest(gradient);
    rm_real left[RM_FACETS], distances[3], beyond[3][RM_FACETS], least = infinite();
    vec normals[3], best = no_vec();
    for (int n = 0; n < box->count; n++) {
        left[n] = box->bound[n] - dot(box->normal[n], point);
    }
    if (on_face) {
        normals[0] = box->normal[without];
        distances[0] = left[without];
    }
    for (int depth = 0; depth >= 0;) {
        /* Where the last facet is parallel to the others, nothing lies beyond. */
        held_facets held;
        int farther = 0;
        if (hold(normals, on_face + depth, &held)) {
            const vec d = minimum_on(&held, h, gradient, distances), slope = add(gradient, sym_apply(h, d));
            rm_real violation = is_finite(d.x + d.y + d.z) ? R(0.0) : infinite();
            for (int i = on_face; i < held.size; i++) {
                violation = larger(dot(slope, held.axes[i]) / unit, violation);
            }
            farther = violation <= RM_ROUNDING && depth < most;
            for (int n = 0; n < box->count; n++) {
                const rm_real over = dot(box->normal[n], d) - left[n];
                violation = larger(over, violation);
                if (farther) {
                    beyond[depth][n] = over;
                }
            }
            if (violation < least) {
                least = violation;
                best = d;
            }
        }
        if (least <= RM_ROUNDING) {
            break;
        }
        /* Add the facet that the minimum lies farthest beyond; if there is none left, exchange the last one. */
        for (depth -= !farther; depth >= 0; depth--) {
            int next = 0;
            for (int n = 1; n < box->count; n++) {
                next = beyond[depth][n] > beyond[depth][next] ? n : next;
            }
            if (beyond[depth][next] > R(0.0)) {
                beyond[depth][next] = R(0.0);
                normals[on_face + depth] = box->normal[next];
                distances[on_face + depth] = left[next];
                depth++;
                break;
            }
        }
    }
    vec found = within(add(point, best), box);
    found.x = without == 0 ? R(0.0) : found.x;
    found.y = without == 1 ? R(0.0) : found.y;
    found.z = without == 2 ? R(0.0) : found.z;
    return found;
}

#endif
