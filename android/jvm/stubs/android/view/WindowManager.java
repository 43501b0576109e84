package android.view;

/** As much of Android's class as the demo uses: it compiles against it, nothing runs. */
public interface WindowManager {
    /** How a window lies. */
    class LayoutParams {
        public static final int FLAG_KEEP_SCREEN_ON = 128;
    }
}
