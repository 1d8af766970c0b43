/* rodmodel core: a calibrated Cosserat rod of a soft pneumatic actuator, in C99.
 *
 * The library answers where the tip of an actuator is under three chamber pressures and loads, how that changes with
 * them, and which pressures bring the tip to a target. It allocates nothing, keeps no state, reads and writes no
 * file, and every iteration has a bound; any number of threads may call it at once, each with a workspace of its own.
 *
 * Units are SI: m, N, Pa, rad. The base is at the origin and the rod points along +z at rest, chamber k at azimuth
 * 120 deg (k - 1), chamber 1 on +x; `base_position` and `base_rotation` move it. Vectors are three numbers, rotation
 * matrices nine, by rows, with the directors d1, d2, d3 as columns. "World" is the frame in which the base is given,
 * "body" that of a section.
 *
 * The order of calls:
 *
 *     static rm_real workspace[...];                     at least rm_workspace_size(&rod, steps, jacobian)
 *     rm_input input = {0};                              no pressure, no load
 *     rm_options options;   rm_default_options(&options);
 *     rm_solution solution;
 *     input.pressure[0] = 30e3;
 *     if (rm_solve(&rod, &input, &options, NULL, workspace, NULL, &solution) == RM_SUCCESSFUL) ... solution.tip_position
 *
 * What a function writes is written in full, whatever it returns: where an input is bad, numbers are NaN and flags 0.
 * A nearby solution's `unknown` as `start` makes the next solve about half as long.
 *
 * Compile with RM_REAL_FLOAT for single precision. `rm_rod` comes from a calibration: `rodmodel export` writes it as
 * a header of constants.
 */
#ifndef RODMODEL_CORE_H
#define RODMODEL_CORE_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

#ifdef RM_REAL_FLOAT
typedef float rm_real;
#else
typedef double rm_real;
#endif

/* cffi: begin */

/* How a solve ended. */
enum rm_result {
    RM_SUCCESSFUL = 0,     /* the equilibrium under the whole load, on the branch that the rod takes from rest */
    RM_BAD_INPUT = 1,      /* a pressure below zero, a number above 1e300 (1e30 in single precision) or NaN, no rotation
                            * matrix, steps below 1, or a tolerance that is negative or above 0.01 rad */
    RM_UNSTABLE = 2,       /* the rod snaps or buckles before the whole load is on it */
    RM_NOT_CONVERGED = 3,  /* Newton's method found no equilibrium that the rod could have gone to */
    RM_UNRESOLVED = 4,     /* the rod turns too sharply for so few steps: take more */
    RM_TOO_MANY_SHOTS = 5  /* the bound on iterations was met */
};

/* Which parts of an input are used; what is not named is absent, whatever its numbers. */
enum rm_given {
    RM_LOADS = 1,          /* tip_force, tip_moment, gravity, distributed_force, follower_moment */
    RM_FOLLOWER_FORCE = 2, /* follower_force: six unknowns in place of three */
    RM_BASE = 4            /* base_position and base_rotation */
};

/* What a solve does beyond the tip. */
enum rm_ask {
    RM_VOLUMES = 1         /* chamber volumes: two to four more evaluations of the section */
};

/* Section law: a potential of curvature u and pressures p, the mean over images of the section's symmetry. With
 * x = u/u_s, q = p/p_s and, of an image, h = (q[order], tanh(W q[order] + w)),
 *
 *     Pi = E [constant + slope.x + x.A x/2 + q.B x + q.C q/2 + sum_j c_j phi(d_j.x + b_j + e_j.h) + v.(h - h0)] - V0 sum p
 *     phi'(z) = (1 + z^2)^-2
 *
 * Ridges of all images stand one after another; `ridges` is a multiple of 8, filled with ridges of no weight. */
typedef struct {
    int images;                     /* 1 to 6 */
    int ridges;                     /* of one image */
    int features;
    int reserved;
    rm_real pressure_scale;         /* p_s [Pa] */
    rm_real curvature_scale;        /* u_s [1/m] */
    rm_real energy_scale;           /* E [N]: energy per length */
    rm_real rest_volume;            /* V0, of a chamber per length [m^2] */
    rm_real constant;
    rm_real slope[3];
    rm_real quadratic[6];           /* A: entries 11, 12, 13, 22, 23, 33 */
    rm_real slope_by_pressure[9];   /* B, by rows of pressures */
    rm_real pressure_quadratic[9];  /* C, symmetric */
    const int *orders;              /* (images, 3): chamber of each of an image's pressures, 0 to 2 */
    const rm_real *feature_weights; /* W: (features, 3) */
    const rm_real *feature_biases;  /* w: (images, features) */
    const rm_real *rest_features;   /* tanh(w): (images, features) */
    const rm_real *mixing;          /* e: (3 + features, ridges) */
    const rm_real *offsets;         /* b: (ridges) */
    const rm_real *weights;         /* c over the number of images: (images * ridges) */
    const rm_real *directions;      /* d in the axes of the rod: (3, images * ridges) */
    const rm_real *slopes;          /* v over the number of images: (3 + features) */
    const rm_real *guess;           /* of the free curvature x: (images, 3, 3 + features), applied to h - h0 */
} rm_law;

/* Lengths [m] and masses; see the manual's page on the ends for the others. */
typedef struct {
    rm_real body_length;
    rm_real cap_length;
    rm_real mass_per_length;        /* [kg/m] */
    rm_real cap_mass;               /* [kg] */
    rm_real stiff_tip;              /* length before the cap that does not bend */
    rm_real base_turn;              /* turn of the first section by the pressures' moment [rad/Pa] */
    rm_real base_lag;               /* length whose free turn the base lacks */
    rm_real base_stiffness;         /* bending stiffness for which these hold [N m^2]; 0: for any */
    rm_real tip_offset;             /* how far the cap lies beside the arc at large curvature */
    rm_real tip_offset_curvature;   /* curvature at which 71 % of that is reached [1/m] */
    rm_real held_length;            /* length over which chambers keep their volume */
    rm_real shear_compliance;       /* [1/N] */
} rm_actuator;

/* Where the law was calibrated. */
typedef struct {
    rm_real pressure_max[3];        /* [Pa] */
    rm_real pressure_sum_max;       /* [Pa] */
    rm_real moment_max;             /* bending moment on a section [N m] */
    rm_real torque_max;             /* torque on a section [N m] */
} rm_domain;

typedef struct {
    rm_law law;
    rm_actuator actuator;
    rm_domain domain;
    rm_real angle_error;            /* 90 % of states have their bending angle within this of the FEM [rad] */
} rm_rod;

/* Laws of all orientations psi of a winding: rm_orient makes the law of one. */
typedef struct {
    rm_law law;                        /* its biases, rest features, constant and slope are not used */
    const rm_real *shared_biases;      /* (features) */
    const rm_real *orientation_weights; /* (features, 2), of cos 2 psi and sin 2 psi */
    const rm_real *image_signs;        /* (images): psi of an image is sign (psi - turn) */
    const rm_real *image_turns;        /* (images) [rad] */
    const rm_real *image_axes;         /* (images, 9): curvatures in the image's axes from those of the rod */
    const rm_real *bare_directions;    /* (3, ridges), in the image's axes */
    const rm_real *bare_weights;       /* c over the number of images: (ridges) */
} rm_oriented;

/* Pressures, loads and base. All zeros: a rod at rest. */
typedef struct {
    rm_real pressure[3];            /* gauge [Pa], 0 or more */
    rm_real tip_force[3];           /* at the centre of the cap's outer face, dead, world [N] */
    rm_real tip_moment[3];          /* on the cap, dead, world [N m] */
    rm_real gravity[3];             /* acceleration, world [m/s^2] */
    rm_real distributed_force[3];   /* along the body, dead, world [N/m] */
    rm_real follower_force[3];      /* at the centre of the cap's outer face, frame of the cap [N] */
    rm_real follower_moment[3];     /* on the cap, frame of the cap [N m] */
    rm_real base_position[3];       /* [m] */
    rm_real base_rotation[9];
    int given;                      /* enum rm_given, or-ed */
    int reserved;
} rm_input;

typedef struct {
    rm_real tolerance;              /* of Newton's method on u L at the base [rad] */
    int steps;                      /* along the rod; the tip's error falls with their fourth power */
    int max_shots;                  /* integrations of a solve at most, which bounds its time */
    int ask;                        /* enum rm_ask, or-ed */
    int reserved;
} rm_options;

/* Equilibrium. */
typedef struct {
    rm_real tip_position[3];        /* centre of the cap's outer face [m] */
    rm_real tip_rotation[9];        /* frame of the cap */
    rm_real bend[2];                /* (theta cos gamma, theta sin gamma) [rad], smooth where the rod is straight */
    rm_real bending_angle;          /* theta, of the tip's tangent from the base's, past 180 deg continued [rad] */
    rm_real bending_plane;          /* gamma in [0, 2 pi); 0 of a straight rod [rad] */
    rm_real chamber_volume[3];      /* over the body [m^3]; NaN unless RM_VOLUMES is asked for */
    rm_real unknown[6];             /* u L at the base, and the follower force in the frame of the base: a start */
    rm_real free_curvature[3];      /* of the section at these pressures [1/m] */
    rm_real load_fraction;          /* of the loads, at which this is the equilibrium; 1 where all went well */
    rm_real moment_share;           /* largest moment on a section over that of the domain */
    rm_real angle_error;            /* of the bending angle in 90 % of states [rad]; NaN outside the domain */
    int result;                     /* enum rm_result */
    int stable;                     /* whether the second variation of the energy is positive */
    int in_domain;                  /* pressures and moments are those of the calibration */
    int load_steps;
    int shots;                      /* integrations from base to end */
    int steps;                      /* of the nodes: 1 for an arc */
} rm_solution;

/* A section at a step's end, frame of the base, before `mount`. */
typedef struct {
    rm_real position[3];            /* [m] */
    rm_real quaternion[4];          /* of the section's frame, scalar first */
    rm_real turn[3];                /* u L, body frame */
    rm_real rate[3];                /* its derivative by s/L */
    rm_real drift[3];               /* what shear adds to r' */
} rm_node;

/* Derivatives by pressures [1/Pa], tip force [1/N], tip moment [1/(N m)] and gravity [s^2/m]: columns 0-2, 3-5, 6-8,
 * 9-11 of arrays by rows. Turns are omega of dR = (omega x) R, world. */
typedef struct {
    rm_real position[36];           /* (3, 12) */
    rm_real turn[36];               /* (3, 12) */
    rm_real bend[24];               /* (2, 12) */
    rm_real bending_angle[12];      /* NaN where the rod is straight and the angle has no derivative */
    rm_real bending_plane[12];      /* likewise */
} rm_jacobian;

/* Section at one curvature and pressures. */
typedef struct {
    rm_real energy;                 /* potential Pi per length [J/m] */
    rm_real moment[3];              /* dPi/du [N m] */
    rm_real stiffness[9];           /* d2Pi/du2 [N m^2] */
    rm_real volume[3];              /* -dPi/dp, per length [m^2] */
} rm_section;

/* Target of the inverse: a tip position, or a bend. */
typedef struct {
    rm_real point[3];               /* tip position [m]; or theta cos gamma, theta sin gamma [rad] */
    int is_bend;
    int reserved;
} rm_target;

typedef struct {
    rm_real pressure[3];            /* within the domain [Pa] */
    rm_real distance;               /* that is left to the target [m] or [rad] */
    rm_solution solution;           /* of the rod at these pressures */
    int reached;                    /* to 0.1 mm or 1e-3 rad */
    int converged;                  /* no change of pressure comes nearer, here */
    int nearest;                    /* nor does any start of the search over the whole domain */
    int evaluations;                /* solves that the search took */
} rm_inverse_result;

/* Numbers (rm_real) that a workspace of the functions below must have room for. */
size_t rm_workspace_size(const rm_rod *rod, int steps, int with_jacobian);

/* 0 where a rod's sizes and numbers can be used; else RM_BAD_INPUT. Others of these functions do not look. */
int rm_check_rod(const rm_rod *rod);

/* steps 8, tolerance 1e-10 (1e-5 in single precision), 512 shots, nothing more asked. */
void rm_default_options(rm_options *options);

/* Law of one orientation psi [rad]. `memory` holds the law's own arrays, rm_orient_size(oriented) numbers. */
size_t rm_orient_size(const rm_oriented *oriented);
void rm_orient(const rm_oriented *oriented, rm_real psi, rm_real *memory, rm_law *law);

/* Equilibrium. `start`: `unknown` of a solution nearby, which may be `solution` itself, or NULL. `nodes`: room for steps + 1, or NULL. Returns the
 * solution's `result`. From a start that leads to no stable equilibrium the solve begins anew without it. */
int rm_solve(const rm_rod *rod, const rm_input *input, const rm_options *options, const rm_real *start,
             rm_real *workspace, rm_node *nodes, rm_solution *solution);

/* The same for many inputs, each without a start. Returns how many were successful. */
int rm_solve_batch(const rm_rod *rod, const rm_input *inputs, int count, const rm_options *options,
                   rm_real *workspace, rm_solution *solutions);

/* Equilibrium and the derivatives of the tip's pose; of the sections at `count` arc lengths [m] too, where there are
 * some: `positions` and `turns` are (count, 3, 12). The workspace must be one with a Jacobian, and `nodes` given where
 * there are arc lengths. */
int rm_solve_with_jacobian(const rm_rod *rod, const rm_input *input, const rm_options *options,
                           const rm_real *start, rm_real *workspace, rm_node *nodes, rm_solution *solution,
                           rm_jacobian *jacobian, int count, const rm_real *arc_lengths, rm_real *positions,
                           rm_real *turns);

/* Pose and curvature at arc lengths s [m], 0 at the base to the cap's outer face, of a solution and its nodes; NaN
 * beyond. Any of the results may be NULL: positions (count, 3), rotations (count, 9), curvatures (count, 3). */
void rm_stations(const rm_rod *rod, const rm_input *input, const rm_solution *solution, const rm_node *nodes,
                 int count, const rm_real *arc_lengths, rm_real *positions, rm_real *rotations,
                 rm_real *curvatures);

/* Section law: free curvature at pressures, and the section at a curvature. Return 0, or RM_BAD_INPUT. */
int rm_free_curvature(const rm_rod *rod, const rm_real *pressure, rm_real *workspace, rm_real *curvature);
int rm_section_at(const rm_rod *rod, const rm_real *curvature, const rm_real *pressure, rm_real *workspace,
                  rm_section *section);

/* Pressures in the domain that bring the rod to a target, one chamber without pressure where two do; the pressures
 * of `input` are not looked at. The workspace must be one with a Jacobian. Returns the solution's result. */
int rm_inverse(const rm_rod *rod, const rm_target *target, const rm_input *input, const rm_options *options,
               rm_real *workspace, rm_inverse_result *result);

/* The same for many targets under the same loads, or for an input each. Returns how many were reached. */
int rm_inverse_batch(const rm_rod *rod, const rm_target *targets, const rm_input *inputs, int inputs_each,
                     int count, const rm_options *options, rm_real *workspace, rm_inverse_result *results);

/* cffi: end */

/* The workspace as a constant, for a static array: rm_workspace_size of a law of so many images, ridges and features.
 * Two runs of hidden functions, seven numbers a ridge, weights and two sets of nodes, and with a Jacobian the
 * neighbouring solutions at the nodes and the inverse's grid of pressures; and what aligning all of it may take. */
#define RM_PAD (64 / sizeof(rm_real))
#define RM_PADDED(count) (((count) + RM_PAD - 1) / RM_PAD * RM_PAD)
#define RM_NODE_SIZE 16
#define RM_KEPT_SIZE 288
#define RM_EXPANSION_SIZE 22
/* Points a side of that grid, and steps along the rod of the inverse's search under loads: what it returns is solved
 * with the caller's. */
#define RM_GRID 8
#define RM_SEARCH_STEPS 4
#define RM_NODES(steps, with_jacobian) (((with_jacobian) && (steps) < RM_SEARCH_STEPS ? RM_SEARCH_STEPS : (steps)) + 1)
#define RM_WORKSPACE_SIZE(images, ridges, features, steps, with_jacobian)                                             \
    (2 * RM_PADDED(3 + (features)) + 7 * (images) * (ridges) + RM_PADDED(RM_NODES(steps, with_jacobian))              \
     + (2 * RM_NODE_SIZE + 4 * RM_EXPANSION_SIZE) * RM_NODES(steps, with_jacobian)                                    \
     + ((with_jacobian) ? RM_KEPT_SIZE * RM_NODES(steps, with_jacobian) + RM_GRID * RM_GRID * RM_GRID : 0) + RM_PAD)

#ifdef __cplusplus
}
#endif

#endif
