package android.widget;

import android.content.Context;
import android.graphics.Typeface;
import android.view.View;

/** As much of Android's class as the demo uses: it compiles against it, nothing runs. */
public class TextView extends View {
    public TextView(Context context) {
        super(context);
    }

    public CharSequence getText() {
        return "";
    }

    public void setText(CharSequence text) {}

    public Typeface getTypeface() {
        return null;
    }

    public void setTypeface(Typeface typeface) {}

    public float getTextSize() {
        return 0;
    }

    public void setTextSize(float size) {}
}
