/* Poses of the tool by robot.h, a header that `host-cal export` wrote: encoder outputs are read from standard input, and for each
   vector the 16 numbers of its 4 by 4 matrix are printed, row by row. */

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "robot.h"

static void multiply(double a[4][4], double b[4][4])
{
    double product[4][4] = {{0}};
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 4; j++)
            for (int k = 0; k < 4; k++)
                product[i][j] += a[i][k] * b[k][j];
    memcpy(a, product, sizeof product);
}

static void shift(double pose[4][4], double x, double y, double z)
{
    double matrix[4][4] = {{1, 0, 0, x}, {0, 1, 0, y}, {0, 0, 1, z}, {0, 0, 0, 1}};
    multiply(pose, matrix);
}

/* About axis i, towards axis j from there. */
static void turn(double pose[4][4], int i, int j, double angle)
{
    double matrix[4][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
    matrix[i][i] = matrix[j][j] = cos(angle);
    matrix[j][i] = sin(angle);
    matrix[i][j] = -sin(angle);
    multiply(pose, matrix);
}

int main(void)
{
    double q[ROBOT_JOINTS];
    for (;;) {
        double pose[4][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
        for (int i = 0; i < ROBOT_JOINTS; i++)
            if (scanf("%lf", &q[i]) != 1)
                return 0;
        for (int i = 0; i <= ROBOT_JOINTS; i++) {
            const ROBOT_REAL *link = ROBOT_LINKS[i];
            shift(pose, link[0], link[1], link[2]);
            turn(pose, 0, 1, link[3]);
            turn(pose, 2, 0, link[4]);
            turn(pose, 1, 2, link[5]);
            if (i == ROBOT_JOINTS)
                break;
            double value = ROBOT_ENCODERS[i][0] + ROBOT_ENCODERS[i][1] * q[i];
            if (ROBOT_IS_PRISMATIC[i])
                shift(pose, 0, 0, value);
            else
                turn(pose, 0, 1, value);
        }
        for (int i = 0; i < 16; i++)
            printf("%.17g%c", pose[i / 4][i % 4], i == 15 ? '\n' : ' ');
    }
}
