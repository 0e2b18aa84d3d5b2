/* The lesser and the greater of two, as Python's min and max choose: the first unless the second is beyond it. */
#ifndef KERNEL_ORDER_H
#define KERNEL_ORDER_H

static inline double least(double a, double b)
{
    return b < a ? b : a;
}

static inline double most(double a, double b)
{
    return b > a ? b : a;
}

#endif
