package android.view;

/** As much of Android's class as the demo uses: it compiles against it, nothing runs. */
public final class MotionEvent {}
