/* SPDX-License-Identifier: Apache-2.0 */
/* Computes forces at positions that are not finite, or far away, and starts again. */
#include "knob.h"
#include <math.h>
int main(void) {
    static const double positions[] = {NAN, INFINITY, -INFINITY, 1e300, -1e300};
    unsigned k;
    for (k = 0; k < sizeof positions / sizeof positions[0]; ++k) {
        knob_state s;
        double slope;
        knob_start(&s, 9000);
        (void)knob_force_at(&s, positions[k]);
        (void)knob_force_slope_at(&s, positions[k], &slope);
        (void)knob_energy_at(&s, positions[k]);
        knob_advance_at(&s, positions[k]);
        knob_start_at(&s, positions[k]);
        (void)knob_step(&s, 9000);
        knob_start(&s, 9000);
        if (!isfinite(knob_force(&s, 9000)) || !isfinite(knob_step(&s, 9000))) {
            return 1;
        }
    }
    return 0;
}
