/* The roles that a robot of the host build may have. */
#ifndef HOST_ROLES_H
#define HOST_ROLES_H

#include "junior/junior.h"
#include "micro/micro.h"

union host_roles { /* all begin with what any robot has */
    struct robot robot;
    struct junior junior;
    struct micro micro;
};

#endif
