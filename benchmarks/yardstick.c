/* One yardstick: a fixed amount of scalar double-precision work, to compare machines by. A unit
 * quaternion is turned sixty million times by a small rotation and brought back to unit length.
 * Prints the processor seconds it took. */
#include <math.h>
#include <stdio.h>
#include <time.h>

typedef struct {
    double w, x, y, z;
} quaternion;

static quaternion product(quaternion a, quaternion b)
{
    return (quaternion){a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
                        a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}

int main(void)
{
    const long turns = 60000000;
    const quaternion small_turn = {0.999, 0.01, 0.02, 0.03};
    quaternion q = {0.8, 0.3, 0.4, 0.2};
    clock_t start = clock();
    for (long i = 0; i < turns; i++) {
        quaternion p = product(small_turn, q);
        double factor = 1.0 / sqrt(p.w * p.w + p.x * p.x + p.y * p.y + p.z * p.z);
        q = (quaternion){p.w * factor, p.x * factor, p.y * factor, p.z * factor};
    }
    double seconds = (double)(clock() - start) / CLOCKS_PER_SEC;
    printf("%.4f\n", seconds);
    /* The sum is used, or the compiler would drop the loop. */
    fprintf(stderr, "checksum %.12g\n", q.w + q.x + q.y + q.z);
    return 0;
}
