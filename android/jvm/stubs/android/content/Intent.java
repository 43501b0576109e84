package android.content;

/** As much of Android's class as the demo uses: it compiles against it, nothing runs. */
public class Intent {
    public static final String ACTION_SEND = "android.intent.action.SEND";
    public static final String EXTRA_TEXT = "android.intent.extra.TEXT";

    public Intent(String action) {}

    public Intent(Context context, Class<?> what) {}

    public static Intent createChooser(Intent target, CharSequence title) {
        return target;
    }

    public String getType() {
        return null;
    }

    public Intent setType(String type) {
        return this;
    }

    public Intent putExtra(String name, String value) {
        return this;
    }

    public String getStringExtra(String name) {
        return null;
    }

    public int getIntExtra(String name, int otherwise) {
        return otherwise;
    }

    public float getFloatExtra(String name, float otherwise) {
        return otherwise;
    }
}
