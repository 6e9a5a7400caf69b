/* The pump's sine. Our own, because the last bits of a C library's differ between machines. */
#ifndef SV_SINE_H
#define SV_SINE_H

#include "lanes.h"

#define SV_MOST_TURNS 0x1p50 /* beyond, a double no longer tells parts of a turn */

/* sin(2 pi x) for |x| < 2^51, by its Taylor series on a quarter turn (remainder below 1e-18). */
SV_INLINE vf sine_of_turns(vf x)
{
    const double c[] = {6.283185307179586,   -41.34170224039976,    81.60524927607506,    -76.70585975306139,
                        42.058693944897655,  -15.09464257682299,    3.819952584848282,    -0.7181223017785006,
                        0.10422916220813984, -0.012031585942120627, 0.0011309237482517963};
    vf r = x - nearest(x);
    r = select(gt(r, all(0.25)), 0.5 - r, r);
    r = select(lt(r, all(-0.25)), -0.5 - r, r);
    vf square = r * r, sum = all(c[10]);
    for (int n = 9; n >= 0; n--)
        sum = sum * square + c[n];
    return r * sum;
}

#endif
