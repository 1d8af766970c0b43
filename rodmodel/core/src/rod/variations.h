/* Neighbouring solutions by the unknowns of the shooting, and the linearised equations that they satisfy,
 *
 *     phi' = du - u x phi,   K du' = -du x m - u x K du - e3 x (f x phi + R^T dn) - dK u' - u x dm
 *
 * with phi the turn of a section. Integrated as the rod is, they are the derivatives of its steps: Newton's method
 * converges quadratically. */
#ifndef RM_VARIATIONS_H
#define RM_VARIATIONS_H

#include "equilibrium.h"

/* Largest number of columns: derivatives by the unknowns, then by pressures, tip force and gravity. */
#define RM_MOST_COLUMNS 16

typedef rm_real columns_of_rows[3][RM_MOST_COLUMNS];

/* Columns at a section: turns of the frame and changes of u L, body frame. */
typedef struct {
    columns_of_rows phi, kappa;
} variations;

/* Derivatives of the force on a section, `end` + (1 - s/L) `body`, and of the loads on the cap, by the columns' inputs;
 * base frame. */
typedef struct {
    columns_of_rows end, body, cap, lever;
} column_forces;

/* Coefficients of the linearised equations at a section, by s/L. */
typedef struct {
    vec turn;
    rm_real by_kappa[3][3], by_phi[3][3];
    rm_real by_force[3][3]; /* by a force in the frame of the base */
    rm_real ahead;
} linearised;

RM_INLINE void matrix_rows(rm_real rows[3][3], mat m)
{
    rows[0][0] = m.a.x, rows[0][1] = m.b.x, rows[0][2] = m.c.x;
    rows[1][0] = m.a.y, rows[1][1] = m.b.y, rows[1][2] = m.c.y;
    rows[2][0] = m.a.z, rows[2][1] = m.b.z, rows[2][2] = m.c.z;
}

/* Linearise the equations at a section, with `g` the change of its stiffness along u'; `forced` if columns have forces
 * of their own. */
RM_INLINE void linearise_rates(const equilibrium *e, const balanced_section *at, quat q, sym g, int forced,
                               linearised *found)
{
    /* K du' = (m^ - u^ K - dK u') du + E (f x phi + R^T dn), E = -(1 - c f3) e3^ + c (e3 x f) e3^T; written out, as
     * compilers do not drop products with zeros. */
    const rm_real length = e->length, per_length = R(1.0) / length;
    const vec u = at->curvature, m = at->section.moment, f = at->force;
    const sym h = sym_scale(length * length, at->flexibility), k = at->section.stiffness;
    const rm_real t[3][3] = {{u.z * k.xy - u.y * k.xz - g.xx, u.z * k.yy - u.y * k.yz - g.xy - m.z,
                              u.z * k.yz - u.y * k.zz - g.xz + m.y},
                             {u.x * k.xz - u.z * k.xx - g.xy + m.z, u.x * k.yz - u.z * k.xy - g.yy,
                              u.x * k.zz - u.z * k.xz - g.yz - m.x},
                             {u.y * k.xx - u.x * k.xy - g.xz - m.y, u.y * k.xy - u.x * k.yy - g.yz + m.x,
                              u.y * k.xz - u.x * k.yz - g.zz}};
    const rm_real rows[3][3] = {{h.xx, h.xy, h.xz}, {h.xy, h.yy, h.yz}, {h.xz, h.yz, h.zz}};
    rm_real by_force[3][3];
    for (int i = 0; i < 3; i++) {
        const rm_real x = per_length * rows[i][0], y = per_length * rows[i][1], z = per_length * rows[i][2];
        for (int j = 0; j < 3; j++) {
            found->by_kappa[i][j] = x * t[0][j] + y * t[1][j] + z * t[2][j];
        }
        by_force[i][0] = -at->arm * rows[i][1];
        by_force[i][1] = at->arm * rows[i][0];
        by_force[i][2] = e->shear * (rows[i][0] * at->lean.x + rows[i][1] * at->lean.y);
        found->by_phi[i][0] = by_force[i][1] * f.z - by_force[i][2] * f.y;
        found->by_phi[i][1] = by_force[i][2] * f.x - by_force[i][0] * f.z;
        found->by_phi[i][2] = by_force[i][0] * f.y - by_force[i][1] * f.x;
    }
    found->turn = scale(length, u);
    if (forced) {
        rm_real r[3][3];
        matrix_rows(r, mat_of_quat(q));
        found->ahead = at->ahead;
        for (int i = 0; i < 3; i++) {
            for (int j = 0; j < 3; j++) {
                found->by_force[i][j] =
                    by_force[i][0] * r[j][0] + by_force[i][1] * r[j][1] + by_force[i][2] * r[j][2];
            }
        }
    }
}

/* Rates of the columns by s/L; `forces` may be NULL. */
RM_INLINE void rates_of_columns(const linearised *by, int columns, const column_forces *forces, const variations *at,
                                variations *rate)
{
    const rm_real (*a)[3] = by->by_kappa, (*b)[3] = by->by_phi, (*d)[3] = by->by_force;
    const vec turn = by->turn;
    for (int c = 0; c < columns; c += RM_BLOCK) {
        const block p0 = GET(at->phi[0] + c), p1 = GET(at->phi[1] + c), p2 = GET(at->phi[2] + c);
        const block k0 = GET(at->kappa[0] + c), k1 = GET(at->kappa[1] + c), k2 = GET(at->kappa[2] + c);
        PUT(rate->phi[0] + c, k0 - (turn.y * p2 - turn.z * p1));
        PUT(rate->phi[1] + c, k1 - (turn.z * p0 - turn.x * p2));
        PUT(rate->phi[2] + c, k2 - (turn.x * p1 - turn.y * p0));
        for (int i = 0; i < 3; i++) {
            PUT(rate->kappa[i] + c,
                (a[i][0] * k0 + a[i][1] * k1 + a[i][2] * k2) + (b[i][0] * p0 + b[i][1] * p1 + b[i][2] * p2));
        }
        if (forces != NULL) {
            const block n0 = GET(forces->end[0] + c) + by->ahead * GET(forces->body[0] + c);
            const block n1 = GET(forces->end[1] + c) + by->ahead * GET(forces->body[1] + c);
            const block n2 = GET(forces->end[2] + c) + by->ahead * GET(forces->body[2] + c);
            for (int i = 0; i < 3; i++) {
                PUT(rate->kappa[i] + c, GET(rate->kappa[i] + c) + d[i][0] * n0 + d[i][1] * n1 + d[i][2] * n2);
            }
        }
    }
}

RM_INLINE void move_rows(columns_of_rows to, columns_of_rows from, rm_real by, columns_of_rows rate, int columns)
{
    for (int i = 0; i < 3; i++) {
        for (int c = 0; c < columns; c += RM_BLOCK) {
            PUT(to[i] + c, GET(from[i] + c) + by * GET(rate[i] + c));
        }
    }
}

/* Set `to` = `from` + `by` `rate`. */
RM_INLINE void move(variations *to, variations *from, rm_real by, variations *rate, int columns)
{
    move_rows(to->phi, from->phi, by, rate->phi, columns);
    move_rows(to->kappa, from->kappa, by, rate->kappa, columns);
}

RM_INLINE void take(variations *to, const variations *from, int columns)
{
    for (int i = 0; i < 3; i++) {
        for (int c = 0; c < columns; c += RM_BLOCK) {
            PUT(to->phi[i] + c, GET(from->phi[i] + c));
            PUT(to->kappa[i] + c, GET(from->kappa[i] + c));
        }
    }
}

RM_INLINE vec column_of(columns_of_rows rows, int column)
{
    const vec v = {rows[0][column], rows[1][column], rows[2][column]};
    return v;
}

RM_INLINE void put_column(columns_of_rows rows, int column, vec v)
{
    rows[0][column] = v.x;
    rows[1][column] = v.y;
    rows[2][column] = v.z;
}

/* At the base the columns by u L are units, and others zero. */
RM_INLINE void start_columns(variations *at)
{
    memset(at, 0, sizeof *at);
    for (int c = 0; c < 3; c++) {
        at->kappa[c][c] = R(1.0);
    }
}

#endif
