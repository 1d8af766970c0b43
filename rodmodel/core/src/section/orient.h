/* The law of one orientation of a winding from that of all: the parts that depend on psi, computed once. */
#ifndef RM_ORIENT_H
#define RM_ORIENT_H

#include "vector.h"

static void orient(const rm_oriented *all, rm_real psi, rm_real *memory, rm_law *law)
{
    const int images = all->law.images, features = all->law.features, ridges = all->law.ridges;
    rm_real *biases = memory, *rest = memory + images * features;
    vec slope = no_vec();
    *law = all->law;
    law->feature_biases = biases;
    law->rest_features = rest;
    law->constant = R(0.0);
    for (int image = 0; image < images; image++, biases += features, rest += features) {
        const rm_real twice = R(2.0) * all->image_signs[image] * (psi - all->image_turns[image]);
        const rm_real cosine = rm_cos(twice), sine = rm_sin(twice);
        const mat axes = mat_of_rows(all->image_axes + 9 * image);
        vec pull = no_vec();
        for (int f = 0; f < features; f++) {
            const rm_real *w = all->orientation_weights + 2 * f;
            biases[f] = all->shared_biases[f] + w[0] * cosine + w[1] * sine;
            rest[f] = rm_tanh(biases[f]);
        }
        for (int j = 0; j < ridges; j++) {
            rm_real z = law->offsets[j];
            for (int f = 0; f < features; f++) {
                z += rest[f] * law->mixing[(3 + f) * ridges + j];
            }
            const rm_real r = R(1.0) / (R(1.0) + z * z), c = all->bare_weights[j];
            const vec d = {all->bare_directions[j], all->bare_directions[ridges + j],
                           all->bare_directions[2 * ridges + j]};
            /* Potential and moment vanish at rest. */
            law->constant -= c * R(0.5) * (z * r + rm_atan(z));
            pull = along(pull, c * r * r, d);
        }
        slope = sub(slope, mat_back(axes, pull));
    }
    put_vec(law->slope, slope);
}

#endif
