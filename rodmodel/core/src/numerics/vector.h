/* Vectors, symmetric matrices, quaternions, and the exponential map of SE(3). */
#ifndef RM_VECTOR_H
#define RM_VECTOR_H

#include "real.h"

typedef struct {
    rm_real x, y, z;
} vec;

/* Symmetric matrix: entries 11, 12, 13, 22, 23, 33. */
typedef struct {
    rm_real xx, xy, xz, yy, yz, zz;
} sym;

/* Unit quaternion, scalar part first. */
typedef struct {
    rm_real w;
    vec v;
} quat;

/* Matrix by columns. */
typedef struct {
    vec a, b, c;
} mat;

RM_INLINE vec vec_of(const rm_real *p)
{
    const vec v = {p[0], p[1], p[2]};
    return v;
}

RM_INLINE void put_vec(rm_real *p, vec v)
{
    p[0] = v.x;
    p[1] = v.y;
    p[2] = v.z;
}

RM_INLINE vec no_vec(void)
{
    const vec v = {R(0.0), R(0.0), R(0.0)};
    return v;
}

RM_INLINE vec add(vec a, vec b)
{
    const vec v = {a.x + b.x, a.y + b.y, a.z + b.z};
    return v;
}

RM_INLINE vec sub(vec a, vec b)
{
    const vec v = {a.x - b.x, a.y - b.y, a.z - b.z};
    return v;
}

RM_INLINE vec scale(rm_real s, vec a)
{
    const vec v = {s * a.x, s * a.y, s * a.z};
    return v;
}

/* a + s b */
RM_INLINE vec along(vec a, rm_real s, vec b)
{
    const vec v = {a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
    return v;
}

RM_INLINE vec cross(vec a, vec b)
{
    const vec v = {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
    return v;
}

/* e3 x a */
RM_INLINE vec axis_cross(vec a)
{
    const vec v = {-a.y, a.x, R(0.0)};
    return v;
}

RM_INLINE rm_real dot(vec a, vec b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

RM_INLINE rm_real largest(vec a)
{
    const rm_real x = rm_abs(a.x), y = rm_abs(a.y), z = rm_abs(a.z);
    /* The sum returns a NaN if there is one. */
    return (x >= y && x >= z) ? x : ((y >= z && x <= y) ? y : ((z >= x && z >= y) ? z : x + y + z));
}

RM_INLINE vec sym_apply(sym m, vec a)
{
    const vec v = {m.xx * a.x + m.xy * a.y + m.xz * a.z, m.xy * a.x + m.yy * a.y + m.yz * a.z,
                   m.xz * a.x + m.yz * a.y + m.zz * a.z};
    return v;
}

/* Invert by Cramer's rule. */
RM_INLINE sym sym_inverse(sym m)
{
    const rm_real p = m.yy * m.zz - m.yz * m.yz, q = m.xz * m.yz - m.xy * m.zz, r = m.xy * m.yz - m.xz * m.yy;
    const rm_real s = R(1.0) / (m.xx * p + m.xy * q + m.xz * r);
    const sym inverse = {s * p, s * q, s * r, s * (m.xx * m.zz - m.xz * m.xz), s * (m.xy * m.xz - m.xx * m.yz),
                         s * (m.xx * m.yy - m.xy * m.xy)};
    return inverse;
}

/* Return whether a matrix is positive definite, by its leading minors. */
RM_INLINE int sym_is_positive(sym m)
{
    const rm_real minor = m.xx * m.yy - m.xy * m.xy;
    const rm_real whole = m.zz * minor - m.xx * m.yz * m.yz - m.yy * m.xz * m.xz + R(2.0) * m.xy * m.yz * m.xz;
    return (m.xx > R(0.0)) & (minor > R(0.0)) & (whole > R(0.0));
}

/* Least eigenvalue, the trigonometric root of the characteristic polynomial. */
RM_INLINE rm_real sym_least_eigenvalue(sym m)
{
    const rm_real mean = (m.xx + m.yy + m.zz) / R(3.0);
    const rm_real x = m.xx - mean, y = m.yy - mean, z = m.zz - mean;
    const rm_real aside = m.xy * m.xy + m.xz * m.xz + m.yz * m.yz;
    const rm_real half = (x * x + y * y + z * z + R(2.0) * aside) / R(6.0), radius = rm_sqrt(half);
    const rm_real cosine = R(0.5) * (x * y * z + R(2.0) * m.xy * m.yz * m.xz - x * m.yz * m.yz - y * m.xz * m.xz -
                                     z * m.xy * m.xy);
    const rm_real limit = half * radius, sine = rm_sqrt(larger(limit * limit - cosine * cosine, R(0.0)));
    return mean + R(2.0) * radius * rm_cos((rm_atan2(sine, cosine) + R(2.0) * RM_PI) / R(3.0));
}

RM_INLINE rm_real determinant(mat m)
{
    return dot(m.a, cross(m.b, m.c));
}

/* Solve M x = right by Cramer's rule. */
RM_INLINE vec mat_solve(mat m, vec right)
{
    const vec bc = cross(m.b, m.c), ca = cross(m.c, m.a), ab = cross(m.a, m.b);
    const rm_real s = R(1.0) / dot(m.a, bc);
    const vec x = {s * dot(bc, right), s * dot(ca, right), s * dot(ab, right)};
    return x;
}

RM_INLINE vec mat_apply(mat m, vec a)
{
    return along(along(scale(a.x, m.a), a.y, m.b), a.z, m.c);
}

/* Transposed matrix times a vector. */
RM_INLINE vec mat_back(mat m, vec a)
{
    const vec v = {dot(m.a, a), dot(m.b, a), dot(m.c, a)};
    return v;
}

RM_INLINE mat mat_scale(rm_real s, mat m)
{
    const mat found = {scale(s, m.a), scale(s, m.b), scale(s, m.c)};
    return found;
}

RM_INLINE mat mat_product(mat m, mat n)
{
    const mat p = {mat_apply(m, n.a), mat_apply(m, n.b), mat_apply(m, n.c)};
    return p;
}

RM_INLINE mat mat_of_rows(const rm_real *p)
{
    const mat m = {{p[0], p[3], p[6]}, {p[1], p[4], p[7]}, {p[2], p[5], p[8]}};
    return m;
}

RM_INLINE void put_mat(rm_real *p, mat m)
{
    p[0] = m.a.x, p[1] = m.b.x, p[2] = m.c.x;
    p[3] = m.a.y, p[4] = m.b.y, p[5] = m.c.y;
    p[6] = m.a.z, p[7] = m.b.z, p[8] = m.c.z;
}

RM_INLINE quat no_turn(void)
{
    const quat q = {R(1.0), {R(0.0), R(0.0), R(0.0)}};
    return q;
}

/* R^T v */
RM_INLINE vec into_body(quat q, vec v)
{
    const vec t = cross(v, q.v);
    return along(along(v, R(2.0) * q.w, t), R(2.0), cross(t, q.v));
}

/* R v */
RM_INLINE vec out_of_body(quat q, vec v)
{
    const vec t = cross(q.v, v);
    return along(along(v, R(2.0) * q.w, t), R(2.0), cross(q.v, t));
}

/* Rotation matrix of a quaternion, normalised. */
RM_INLINE mat mat_of_quat(quat q)
{
    const rm_real w = q.w, x = q.v.x, y = q.v.y, z = q.v.z;
    const rm_real t = R(2.0) / (w * w + x * x + y * y + z * z);
    const mat m = {{R(1.0) - t * (y * y + z * z), t * (x * y + w * z), t * (x * z - w * y)},
                   {t * (x * y - w * z), R(1.0) - t * (x * x + z * z), t * (y * z + w * x)},
                   {t * (x * z + w * y), t * (y * z - w * x), R(1.0) - t * (x * x + y * y)}};
    return m;
}

/* For an angle theta with x = theta^2: cos(theta/2), sin(theta/2)/theta, and (theta - sin theta)/theta^3. */
typedef struct {
    rm_real cosine, sine, third;
} half_angle;

/* Evaluate a polynomial of eight terms by Estrin's scheme: few operations wait for others. */
RM_INLINE rm_real series(rm_real x, rm_real a, rm_real b, rm_real c, rm_real d, rm_real e, rm_real f, rm_real g,
                         rm_real h)
{
    const rm_real x2 = x * x, x4 = x2 * x2;
    return ((a + b * x) + x2 * (c + d * x)) + x4 * ((e + f * x) + x2 * (g + h * x));
}

RM_INLINE half_angle half_angle_of(rm_real x)
{
    half_angle h;
    if (x < R(1.0)) {
        /* Series; the first terms dropped are below 1e-17. */
        const rm_real y = R(0.25) * x;
        h.cosine = series(y, R(1.0), R(-1.0 / 2.0), R(1.0 / 24.0), R(-1.0 / 720.0), R(1.0 / 40320.0),
                          R(-1.0 / 3628800.0), R(1.0 / 479001600.0), R(-1.0 / 87178291200.0));
        h.sine = R(0.5) * series(y, R(1.0), R(-1.0 / 6.0), R(1.0 / 120.0), R(-1.0 / 5040.0), R(1.0 / 362880.0),
                                 R(-1.0 / 39916800.0), R(1.0 / 6227020800.0), R(-1.0 / 1307674368000.0));
        h.third = series(x, R(1.0 / 6.0), R(-1.0 / 120.0), R(1.0 / 5040.0), R(-1.0 / 362880.0),
                         R(1.0 / 39916800.0), R(-1.0 / 6227020800.0), R(1.0 / 1307674368000.0),
                         R(-1.0 / 355687428096000.0));
    } else {
        const rm_real angle = rm_sqrt(x), cosine = rm_cos(R(0.5) * angle), sine = rm_sin(R(0.5) * angle);
        h.cosine = cosine;
        h.sine = sine / angle;
        h.third = (angle - R(2.0) * sine * cosine) / (x * angle);
    }
    return h;
}

RM_INLINE quat turned(quat q, half_angle h, vec turn)
{
    const vec v = along(along(scale(h.cosine, q.v), q.w * h.sine, turn), h.sine, cross(q.v, turn));
    const quat found = {q.w * h.cosine - h.sine * dot(q.v, turn), v};
    return found;
}

/* Quaternion of R exp(turn). */
RM_INLINE quat turn_by(quat q, vec turn)
{
    return turned(q, half_angle_of(dot(turn, turn)), turn);
}

/* Take the step (shift, turn) on SE(3): return the quaternion of R exp(turn), and set `way` to the displacement
 * R V(turn) shift in the base frame, with V = I + B turn^ + C turn^^2, B = (1 - cos)/theta^2,
 * C = (theta - sin)/theta^3. Murray, Li and Sastry (1994), A Mathematical Introduction to Robotic Manipulation,
 * eq. 2.36. */
RM_INLINE quat screw_by(quat q, vec turn, vec shift, vec *way)
{
    const half_angle h = half_angle_of(dot(turn, turn));
    const vec once = cross(turn, shift);
    *way = out_of_body(q, along(along(shift, R(2.0) * h.sine * h.sine, once), h.third, cross(turn, once)));
    return turned(q, h, turn);
}

#endif
