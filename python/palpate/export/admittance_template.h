
/* ------------------------------------------------------------------------------ object of an admittance display */

/* The force of the hand moves the object m y'' + B_o y' + f(y) = F, one implicit step a tick:
     f(y) + p y = q,   p = m / T^2 + B_o / T,   q = p z,   z = y_k-1 + (F + (m / T^2)(y_k-1 - y_k-2)) / p.
   The table of the load line gives the force f(y) at z, and the step is y - y_k-1 = z - y_k-1 - f(y) / p. */
#define NAME_INERTIAL (NAME_MASS / (NAME_PERIOD * NAME_PERIOD))
#define NAME_LOAD_SLOPE (NAME_INERTIAL + NAME_OBJECT_DAMPING / NAME_PERIOD)
/* Friction of the object: for the steps of the display, and for the error of the table as a force on the object. */
#define NAME_FRICTION \
    ((NAME_real)(NAME_DISPLAY_FRICTION + (1.0 + NAME_STEEPEST / NAME_LOAD_SLOPE) * (double)NAME_STEP_ERROR))
//@ if single
/* Positions are a count of NAME_STEP and a fraction of it; steps are in counts. */
#define NAME_PER_FORCE ((NAME_real)(1.0 / (NAME_LOAD_SLOPE * NAME_STEP)))
//@ else
#define NAME_PER_FORCE (1.0 / NAME_LOAD_SLOPE)
//@ end
#define NAME_KEPT_STEP ((NAME_real)(NAME_INERTIAL / NAME_LOAD_SLOPE))

typedef struct NAME_object {
//@ if single
    int32_t count;      /* position of the object, whole counts */
    NAME_real fraction; /* position of the object, rest */
//@ else
    double position; /* position of the object */
//@ end
    NAME_real step;    /* last step of the object */
    NAME_real command; /* last command */
} NAME_object;

/* Moves the object by a step. */
NAME_INLINE void NAME_object_move(NAME_object *o, NAME_real step) {
//@ if single
    int32_t whole;
    o->fraction += step;
    whole = (int32_t)o->fraction;
    o->count += whole;
    o->fraction -= (NAME_real)whole;
//@ else
    o->position += step;
//@ end
    o->step = step;
}

/* Position of the object, with a number of counts (single precision) or a distance (double) added. */
NAME_INLINE NAME_real NAME_object_position(const NAME_object *o, NAME_real added) {
//@ if single
    return ((NAME_real)o->count + (o->fraction + added)) * (NAME_real)NAME_STEP;
//@ else
    return o->position + added;
//@ end
}

/* Sets the object at rest at a position. */
static inline void NAME_object_start(NAME_object *o, double position) {
//@ if single
    const double counts = position / NAME_STEP;
    o->count = counts > 1e9 ? 1000000000 : counts < -1e9 ? -1000000000 : (int32_t)counts;
    o->fraction = (NAME_real)(counts - (double)o->count);
//@ else
    o->position = position;
//@ end
    o->step = 0;
    o->command = (NAME_real)position;
}

/* Step of the object with a force, without friction and rate limit. */
NAME_INLINE NAME_real NAME_object_solve(const NAME_object *o, NAME_real force) {
    const NAME_real free = force * NAME_PER_FORCE + o->step * NAME_KEPT_STEP;
//@ if single
    const NAME_real most = 16777216.0f;
    const NAME_real moved = o->fraction + (free > most ? most : free < -most ? -most : free);
    const int32_t whole = (int32_t)moved;
    return free - NAME_response(o->count + whole, moved - (NAME_real)whole) * NAME_PER_FORCE;
//@ else
    return free - NAME_response(o->position + free) * NAME_PER_FORCE;
//@ end
}

/* One tick: returns the position command for the measured force. A force that is not a number, or an infinite one, holds
   the last command. */
static inline NAME_real NAME_object_step(NAME_object *o, NAME_real force) {
    const NAME_real most = (NAME_real)NAME_LARGEST_STEP;
    NAME_real step;
    if (!(force - force == 0)) {
        return o->command;
    }
    step = NAME_object_solve(o, force - NAME_FRICTION);
    if (step <= 0) {
        step = NAME_object_solve(o, force + NAME_FRICTION);
        step = step > 0 ? 0 : step;
    }
    step = step > most ? most : step < -most ? -most : step;
    NAME_object_move(o, step);
    o->command = NAME_object_position(o, (NAME_real)NAME_AHEAD * step);
    return o->command;
}
